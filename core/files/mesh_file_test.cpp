// SPDX-License-Identifier: Apache-2.0
#include "core/drape_mesh.hpp"

#include <gmock/gmock.h>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "tests/support/paths.hpp"

namespace drape {
namespace {

namespace fs = std::filesystem;

MeshFile read_as(const std::string& name, const std::string& text) {
  const test::TemporaryFolder folder;
  write_durable(folder.path() / name, text);
  return read_mesh_file(folder.path() / name);
}

const std::string kHead =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
const std::string kCorners = "0 0 0\n+1 0 0\n0 1e0 0\n";

TEST(MeshFiles, AreReadByMeaning) {
  const MeshFile ply = read_as("a.ply", kHead + kCorners + "3 0 1 2\n");
  const MeshFile obj = read_as("a.OBJ", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 3\n");
  for (const MeshFile& mesh : {ply, obj}) {
    ASSERT_EQ(mesh.points.size(), 3U);
    EXPECT_EQ(mesh.points[1], Eigen::Vector3d(1, 0, 0));
    ASSERT_EQ(mesh.triangles.size(), 1U);
    EXPECT_EQ(mesh.triangles[0][2].point, 2U);
  }
}

TEST(MeshFiles, PromiseNoMoreThanTheirBytesHold) {
  const auto with = [](std::string head, const std::string& from, const std::string& to) {
    return head.replace(head.find(from), from.size(), to) + kCorners;
  };
  for (const std::string& text :
       {with(kHead, "vertex 3", "vertex 4000000000"),
        with(kHead, "vertex 3", "vertex 18446744073709551615"),
        with(kHead, "vertex 3", "vertex -1"), with(kHead, "face 1", "face 999999999"),
        with(kHead, "property float z\n", ""),
        std::string("ply\nformat ascii 1.0\nelement vertex 4000000000\nend_header\n"),
        kHead + kCorners + "1e300 0 1 2\n", kHead + kCorners + "-1 0 1 2\n",
        kHead + kCorners + "2.5 0 1 2\n", kHead + kCorners + "3 0 1 1e300\n",
        kHead + kCorners + "3 0 1 0.5\n", kHead + kCorners + "3 0 1 -1\n",
        kHead + kCorners + "3 0 1 3\n", kHead + kCorners + "3 0 1 nan\n"}) {
    try {
      static_cast<void>(read_as("bomb.ply", text));
      FAIL() << text;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::bad_input) << text;
    }
  }
}

}  // namespace
}  // namespace drape
