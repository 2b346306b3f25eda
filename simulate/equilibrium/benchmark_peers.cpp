// SPDX-License-Identifier: Apache-2.0
// The drape of static_benchmark.cpp by programs that others made, for comparison: Bullet's soft
// body, six seconds of motion, and Blender's cloth, two. Both have stiffnesses without units and
// neither says when it is at rest, so their strain and fastest point stand beside their time. A
// row whose program is not installed is skipped and says so.
#include <benchmark/benchmark.h>
#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "tests/support/paths.hpp"

#ifdef DRAPE_HAVE_BULLET
#include <btBulletDynamicsCommon.h>

#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#endif

namespace {

constexpr double kMotion_s = 6;
constexpr double kBlenderMotion_s = 2;  // shorter, for it takes longest

#ifdef DRAPE_HAVE_BULLET
constexpr double kBulletStep_s = 1.0 / 240;
constexpr btScalar kHalf = 0.1F, kRadius = 0.045F, kMass = 0.138F * 0.04F;  // m, m, kg

/// Fastest node (mm/s), mean strain of the links (%), lowest node (mm).
void count_bullet(const btSoftBody& cloth, benchmark::State& state) {
  double fastest = 0;
  double lowest = 1;
  for (int i = 0; i < cloth.m_nodes.size(); ++i) {
    fastest = std::max(fastest, static_cast<double>(cloth.m_nodes[i].m_v.length()));
    lowest = std::min(lowest, static_cast<double>(cloth.m_nodes[i].m_x.z()));
  }
  double strain = 0;
  for (int i = 0; i < cloth.m_links.size(); ++i) {
    const btSoftBody::Link& link = cloth.m_links[i];
    const double length = (link.m_n[1]->m_x - link.m_n[0]->m_x).length();
    strain += std::abs(length / static_cast<double>(link.m_rl) - 1);
  }
  state.counters["fastest_mm_per_s"] = fastest * 1e3;
  state.counters["mean_strain_percent"] = 100 * strain / std::max(1, cloth.m_links.size());
  state.counters["lowest_mm"] = lowest * 1e3;
}

/// Its solver has no sticking friction, so the middle node is held; else the cloth slides off.
void bullet_soft_body(benchmark::State& state) {
  for ([[maybe_unused]] auto _ : state) {
    btSoftBodyRigidBodyCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher(&configuration);
    btDbvtBroadphase broadphase;
    btSequentialImpulseConstraintSolver solver;
    btSoftRigidDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
    const btVector3 gravity(0, 0, -9.80665F);
    world.setGravity(gravity);
    btSoftBodyWorldInfo& info = world.getWorldInfo();
    info.m_gravity = gravity;
    info.m_broadphase = &broadphase;
    info.m_dispatcher = &dispatcher;
    info.m_sparsesdf.Initialize();
    btSphereShape ball(kRadius);
    btRigidBody sphere(btRigidBody::btRigidBodyConstructionInfo(0, nullptr, &ball));
    world.addRigidBody(&sphere);
    const int side = static_cast<int>(state.range(0));
    const btScalar z = kRadius + 0.003F;
    btSoftBody* cloth =
        btSoftBodyHelpers::CreatePatch(info, {-kHalf, -kHalf, z}, {kHalf, -kHalf, z},
                                       {-kHalf, kHalf, z}, {kHalf, kHalf, z}, side, side, 0, true);
    cloth->getCollisionShape()->setMargin(0.0005F);
    cloth->m_cfg.kDF = 0.5F;
    cloth->m_cfg.kDP = 0.01F;
    cloth->m_cfg.piterations = 10;
    cloth->setTotalMass(kMass);
    cloth->setMass((side / 2) * side + side / 2, 0);
    world.addSoftBody(cloth);
    const int steps = static_cast<int>(std::lround(kMotion_s / kBulletStep_s));
    for (int k = 0; k < steps; ++k) {
      world.stepSimulation(static_cast<btScalar>(kBulletStep_s), 0);
    }
    count_bullet(*cloth, state);
    world.removeSoftBody(cloth);
    delete cloth;
    world.removeRigidBody(&sphere);
  }
}
#else
void bullet_soft_body(benchmark::State& state) {
  state.SkipWithError(
      "Bullet is missing: install the Debian package libbullet-dev and build again");
}
#endif

double children_cpu_s() {
  rusage usage{};
  getrusage(RUSAGE_CHILDREN, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

/// The time is the CPU time of its process, its start included.
void blender_cloth(benchmark::State& state) {
  if (std::system("command -v blender > /dev/null 2>&1") != 0) {
    state.SkipWithError("Blender is missing: install the Debian package blender");
    return;
  }
  const std::string script =
      (drape::test::source_root() / "simulate/equilibrium/benchmark_blender.py").string();
  const std::string command = fmt::format(
      "blender --background --factory-startup --python-exit-code 1 --python '{}' -- {} {}", script,
      state.range(0), kBlenderMotion_s);
  for ([[maybe_unused]] auto _ : state) {
    const double before_s = children_cpu_s();
    FILE* pipe = popen((command + " 2>/dev/null").c_str(), "r");
    bool said = false;
    char line[512];
    while (pipe != nullptr && std::fgets(line, sizeof line, pipe) != nullptr) {
      double fastest = 0;
      double strain = 0;
      double lowest = 0;
      if (std::sscanf(line, "drape-peer %lf %lf %lf", &fastest, &strain, &lowest) != 3) continue;
      said = true;
      state.counters["fastest_mm_per_s"] = fastest;
      state.counters["mean_strain_percent"] = strain;
      state.counters["lowest_mm"] = lowest;
    }
    if (pipe == nullptr || pclose(pipe) != 0 || !said) {
      state.SkipWithError("Blender's result is missing: it did not run the scene to its end");
      return;
    }
    state.SetIterationTime(children_cpu_s() - before_s);
  }
}

BENCHMARK(bullet_soft_body)
    ->Arg(21)
    ->Arg(31)
    ->Arg(101)
    ->Iterations(1)
    ->Unit(benchmark::kSecond)
    ->MeasureProcessCPUTime();
BENCHMARK(blender_cloth)->Arg(31)->Iterations(1)->Unit(benchmark::kSecond)->UseManualTime();

}  // namespace
