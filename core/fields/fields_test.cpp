// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <fstream>

#include "core/program/program.hpp"
#include "core/units.hpp"
#include "tests/support/paths.hpp"

namespace drape {
namespace {
namespace thing {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using units::mm;

enum class Start { flat, measured };

struct Ball {
  double radius_m = 0;
};

struct Box {
  Eigen::Vector3d size_m = {0, 0, 0};
  double edge_m = 0;
};

struct Hole {
  int row = 0;
  std::optional<Eigen::Vector2d> at_m;
};

/// A record with one value of each kind.
struct Thing {
  Document document;
  std::string name;
  Start start = Start::flat;
  double friction = 0;
  std::optional<double> uncertainty;
  bool round = false;
  std::filesystem::path fabric;
  std::vector<std::string> notes;
  std::vector<std::vector<int>> cells;
  std::variant<Ball, Box> shape;
  std::vector<Hole> holes;
  std::map<std::string, double> weights;
  Eigen::MatrixXd covariance;
  Value raw;
};

void fields(Fields& f, Ball& ball) {
  double diameter_m = 2 * ball.radius_m;
  f({"diameter_mm", "diameter", mm, above_zero}, diameter_m);
  ball.radius_m = diameter_m / 2;
}

void fields(Fields& f, Box& box) {
  f({"size_mm", "full edges", mm, above_zero, 3000, "measure the box"}, box.size_m);
  f.otherwise({"edge_mm", "radius of the edges", mm, 0}, box.edge_m);
  f.rule(2 * box.edge_m <= box.size_m.minCoeff(), "edge_mm", "the edges are larger than the box",
         "give at most half of size_mm");
}

void fields(Fields& f, Hole& hole) {
  f({"row", "mark along the warp", 1, 0}, hole.row);
  f.if_any({"at_mm", "place in the plane", mm}, hole.at_m);
}

}  // namespace thing
}  // namespace

template <>
inline constexpr std::string_view names_of<thing::Start>[] = {"flat", "as-measured"};
template <>
inline constexpr Format format_of<thing::Thing>{"thing", Syntax::toml, 2, "a thing"};

namespace {
namespace thing {

void fields(Fields& f, Thing& thing) {
  f(Field{"name", "name of the thing"}.plain_name(), thing.name);
  f({"start", "how it starts"}, thing.start);
  f({"friction", "Coulomb coefficient", 1, 0, 3, "measure it on a tilting plane"}, thing.friction);
  f({"uncertainty", "standard uncertainty"}, thing.uncertainty);
  f.otherwise({"round", "whether it is round"}, thing.round);
  f.otherwise({"fabric", "file of its fabric"}, thing.fabric);
  f.if_any({"notes", "texts"}, thing.notes);
  f.if_any({"cells", "pairs of whole numbers", 1, 0}, thing.cells);
  f.one_of({"kind", "shape"}, thing.shape, {"ball", "box"});
  f.if_any({"hole", "holes"}, thing.holes);
  f.if_any({"weight", "weights by name"}, thing.weights);
  f.otherwise({"covariance", "any matrix"}, thing.covariance);
  f.otherwise({"raw", "anything"}, thing.raw);
}

constexpr const char* kGood = R"(schema = "drapebench/thing/2"
# a comment
name = "A"
start = "as-measured"
friction = 1
uncertainty = 0.5
round = true
fabric = "../A.toml"
notes = ["x", "y"]
cells = [[1, 2], [3, 4]]
kind = "box"
size_mm = [1, 2, 3.5]
covariance = [[1.0, 0.5], [0.5, 2.0]]
[weight]
a = 1.5
b = 2
[[hole]]
row = 3
[[hole]]
row = 4
at_mm = [1, 2]
[raw]
deep = [{x = 1}]
)";

Thing read(const std::string& text) {
  return read_record<Thing>(Document("thing.toml", Syntax::toml, text));
}

std::string faults_of(const std::string& text, Syntax syntax = Syntax::toml) {
  Thing read;
  std::string all;
  for (const Error& error : faults_of_reading(Document("f", syntax, text), walk_through(read)))
    all += std::string(error.what()) + "\n";
  return all;
}

std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return "nothing was thrown";
}

TEST(Fields, ReadsEveryKindOfValue) {
  const Thing thing = read(kGood);
  EXPECT_EQ(thing.name, "A");
  EXPECT_EQ(thing.start, Start::measured);
  EXPECT_EQ(thing.friction, 1);
  EXPECT_EQ(thing.uncertainty, 0.5);
  EXPECT_TRUE(thing.round);
  EXPECT_EQ(thing.fabric, "../A.toml");
  EXPECT_EQ(Document("a/b/thing.toml", Syntax::toml, "").beside("../A.toml"), "a/A.toml");
  EXPECT_THAT(thing.notes, ElementsAre("x", "y"));
  EXPECT_THAT(thing.cells, ElementsAre(ElementsAre(1, 2), ElementsAre(3, 4)));
  EXPECT_EQ(std::get<Box>(thing.shape).size_m, Eigen::Vector3d(1 * mm, 2 * mm, 3.5 * mm));
  ASSERT_EQ(thing.holes.size(), 2U);
  EXPECT_FALSE(thing.holes[0].at_m.has_value());
  EXPECT_EQ(thing.holes[1].at_m->y(), 2 * mm);
  EXPECT_EQ(thing.weights.at("b"), 2);
  EXPECT_EQ(thing.covariance(0, 1), 0.5);
  EXPECT_EQ(one_line(thing.raw), R"({"deep":[{"x":1}]})");
  EXPECT_EQ(thing.document.sha256(), sha256_of(std::string(kGood)));
}

TEST(Fields, WritesWhatItReadsInTheOrderOfTheDescription) {
  const std::string once = text_of(read(kGood));
  EXPECT_EQ(text_of(read(once)), once);
  const Value value = value_of(read(once));
  EXPECT_EQ(value.get_if<Value::Table>()->at(1).first, "name");
  EXPECT_EQ(one_line(*value.find("size_mm")), "[1.0,2.0,3.5]");
  EXPECT_EQ(one_line(*value_of(Thing{}).find("uncertainty")), "null");
  EXPECT_EQ(value_of(Thing{}).find("notes"), nullptr);
}

TEST(Fields, NamesEveryFaultOfAFileWithItsLine) {
  const std::string faults = faults_of(R"(schema = "drapebench/thing/2"
name = "a/b"
start = "flatt"
friction = 40
roud = true
kind = "box"
size_mm = [1.0, 2.0]
edge_mm = nan
cells = [[1, 2], [3, -4]]
[[hole]]
row = 1.5
[[hole]]
row_mm = 2
)");
  for (const char* part :
       {"`a/b` cannot be a name\n  where: f:2, field `name`",
        "`start` is `flatt`, which is not known\n  where: f:3, field `start`\n  to do: use `flat` "
        "or `as-measured`, did you mean `flat`?",
        "`friction` is 40\n  where: f:4, field `friction`\n  to do: measure it on a tilting plane",
        "unknown key `roud`\n  where: f:5, field `roud`\n  to do: did you mean `round`?",
        "`size_mm` is not an array of 3 finite numbers\n  where: f:7, field `size_mm`",
        "`edge_mm` is not a finite number\n  where: f:8", "field `cells.2.2`",
        "`row` is not a whole number up to 2^30\n  where: f:11, field `hole.1.row`",
        "`hole.2.row` is missing, `hole.2.row_mm` is not a key here\n  where: f:13"})
    EXPECT_THAT(faults, HasSubstr(part));
  EXPECT_EQ(std::count(faults.begin(), faults.end(), '\n'), 9 * 3) << faults;
}

TEST(Fields, ThrowsOneErrorThatHoldsAllFaults) {
  const std::string text = "schema = \"drapebench/thing/2\"\nname = 3\nstart = 4\n";
  try {
    static_cast<void>(read(text));
    FAIL() << "a bad file was read";
  } catch (const Error& error) {
    EXPECT_EQ(error.each().size(), 4U);  // name, start, friction, kind
    EXPECT_THAT(error.what(), AllOf(HasSubstr("`name` is not a text"),
                                    HasSubstr("also: thing.toml:3, field `start`: ")));
  }
}

TEST(Fields, AsksARuleOnlyOfValuesThatAreThere) {
  const std::string good(kGood), edge = "edge_mm = 0.6\n";
  const auto with = [&](const std::string& line, const std::string& size) {
    std::string text = good;
    text.insert(text.find("covariance"), line);
    text.replace(text.find("[1, 2, 3.5]"), 11, size);
    return text;
  };
  EXPECT_THAT(faults_of(with(edge, "[1, 2, 3.5]")),
              AllOf(HasSubstr("the edges are larger than the box"), HasSubstr("field `edge_mm`")));
  EXPECT_THAT(faults_of(with("edge_mm = 0.5\n", "[1, 2, 3.5]")), IsEmpty());
  EXPECT_THAT(faults_of(with(edge, "[1, 2]")),
              testing::Not(HasSubstr("the edges are larger than the box")));
}

TEST(Fields, RefusesOtherFormatsAndNewerOnesInOneSentence) {
  const auto schema = [](const std::string& text) {
    return message_of([&] { static_cast<void>(read("schema = " + text + "\n")); });
  };
  EXPECT_THAT(schema("\"drapebench/thing/3\""),
              AllOf(HasSubstr("newer than this program, which reads drapebench/thing/2"),
                    testing::Not(HasSubstr("missing"))));
  EXPECT_THAT(schema("\"drapebench/other/1\""), HasSubstr("this version reads"));
  EXPECT_THAT(schema("3"), HasSubstr("`schema` is not a text"));
  EXPECT_THAT(message_of([] { static_cast<void>(read("x = 1\n")); }),
              HasSubstr("`schema` is missing"));
}

TEST(Fields, JsonHasLinesAndPointersAndToleratesFurtherKeys) {
  const std::string faults = faults_of(R"({"schema": "drapebench/thing/2", "name": "A",
  "start": "flat", "friction": -1,
  "more": 1, "kind": "ball",
  "diameter_mm": 2, "hole": [
    {"row": 1},
    {"row": 12
}, {"row": 1.5,
 "at_mm": [1, null]}]})",
                                       Syntax::json);
  EXPECT_THAT(faults, AllOf(HasSubstr("`friction` is -1"), HasSubstr("f:2, field `/friction`"),
                            HasSubstr("f:7, field `/hole/2/row`"),
                            HasSubstr("f:8, field `/hole/2/at_mm`")));
  EXPECT_THAT(faults, testing::Not(HasSubstr("more")));
}

TEST(Fields, TheHashOfTheValuesForgetsSpelling) {
  const auto hash = [](const std::string& text) {
    return Document("f", Syntax::toml, text).values_sha256();
  };
  EXPECT_EQ(hash("a = 1\nb.c = \"x\"\n"), hash("b = {c = 'x'} # why\na = 1.0\n"));
  EXPECT_NE(hash("a = 1\n"), hash("a = 1.5\n"));
  EXPECT_NE(hash("a = [1, 2]\n"), hash("a = [2, 1]\n"));
  EXPECT_NE(hash("a = \"1\"\n"), hash("a = 1\n"));
}

/// Message of a text that is refused before its values are read.
std::string refusal(const std::string& text, Syntax syntax) {
  return message_of([&] { static_cast<void>(Document("f", syntax, text)); });
}

TEST(Document, RefusesTextsThatWouldBreakTheStack) {
  std::string dotted = "a";
  for (int i = 0; i < 200'000; ++i) dotted += ".a";
  EXPECT_THAT(refusal("x = 1\n" + dotted + " = 1\n", Syntax::toml),
              AllOf(HasSubstr("a key of more than 20 parts"), HasSubstr("f:2")));
  EXPECT_THAT(refusal("[" + dotted + "]\n", Syntax::toml), HasSubstr("a key of more"));
  EXPECT_THAT(refusal("x = " + std::string(200'000, '['), Syntax::toml), HasSubstr("not a TOML"));
  EXPECT_THAT(refusal(std::string(200'000, '['), Syntax::json), HasSubstr("nested deeper"));
  // Dots within strings, comments and numbers do not separate keys.
  const std::string dots(100, '.');
  EXPECT_EQ(Document("f", Syntax::toml,
                     "a = \"" + dots + "\" # " + dots + "\nb = '''\n" + dots + "'''\nc = [" +
                         "1.5, 1.5, 1.5, 1.5, 1.5, 1.5, 1.5, 1.5, 1.5, 1.5, 1.5, 1.5, 1.5, 1.5, "
                         "1.5, 1.5, 1.5, 1.5, 1.5, 1.5, 1.5]\n")
                .root()
                .find("a")
                ->get_if<std::string>()
                ->size(),
            100U);
}

TEST(Document, RefusesWhatIsNoTextOfItsSyntax) {
  EXPECT_THAT(refusal("{\"a\": 1,\n\"b\": 2,\n\"a\": 3}", Syntax::json),
              AllOf(HasSubstr("the key `a` stands twice"), HasSubstr("f:3")));
  EXPECT_THAT(refusal("{\"a\":\n\n}", Syntax::json),
              AllOf(HasSubstr("not a JSON file"), HasSubstr("f:3")));
  EXPECT_THAT(refusal("a = 1\na = 2\n", Syntax::toml), HasSubstr("f:2"));
  EXPECT_THAT(refusal("a = 1979-05-27\n", Syntax::toml), HasSubstr("dates"));
  EXPECT_THAT(refusal(std::string(9 << 20, '\n'), Syntax::toml), HasSubstr("8 MiB"));
  EXPECT_THAT(faults_of("[1]", Syntax::json), HasSubstr("an object is expected"));
}

/// One letter from each range that toml++'s table of spaces does not cover.
TEST(Document, RefusesLettersOutsideTextsAndKeepsThemInside) {
  for (const std::string letter : {"\u00e9", "\u0449", "\u2c60", "\u3042", "\ufb50"}) {
    for (const std::string& text :
         {letter + " = 1\n", "x" + letter + " = 1\n", "x =" + letter + "1\n",
          "x = 1" + letter + "\n", "x = \"\" " + letter + "\n", "[" + letter + "]\n"})
      EXPECT_THAT(refusal("\n" + text, Syntax::toml), HasSubstr("f:2")) << text;
    const Document document("f", Syntax::toml,
                            "x = \"\"\"\\\n  " + letter + "\"\"\" # " + letter + "\n");
    EXPECT_EQ(*document.root().find("x")->get_if<std::string>(), letter);
  }
}

TEST(Schema, NamesTypesRangesAndAlternatives) {
  const Value schema = described<Thing>(kGood).schema;
  const Value& properties = *schema.find("properties");
  EXPECT_EQ(one_line(*properties.find("friction")),
            R"({"type":"number","minimum":0.0,"maximum":3.0,"description":"Coulomb coefficient"})");
  EXPECT_EQ(one_line(*properties.find("start")),
            R"({"enum":["flat","as-measured"],"description":"how it starts"})");
  EXPECT_EQ(one_line(*schema.find("required")), R"(["schema","name","start","friction","kind"])");
  const auto& branches = *schema.find("oneOf")->get_if<Value::List>();
  ASSERT_EQ(branches.size(), 2U);
  EXPECT_EQ(one_line(*branches[1].find("required")), R"(["size_mm"])");
  EXPECT_EQ(schema.find("additionalProperties"), nullptr);
}

struct Options {
  std::filesystem::path sheet;
  int grid = 21;
  double tolerance = 1e-3;
  std::optional<double> thickness_m;
  Start start = Start::flat;
  bool round = false;
  std::vector<std::string> sets;
  std::vector<std::filesystem::path> pictures;
  std::vector<int> grids = {11, 21};
  Eigen::Vector2d place_m = {0, 0};
};

void fields(Fields& f, Options& o) {
  f(Field{"sheet", "sheet to read"}.called("SHEET"), o.sheet);
  f.otherwise(Field{"grid", "particles per side", 1, 5, 401}.called("-g"), o.grid);
  f.otherwise({"tolerance", "largest residual", 1, above_zero}, o.tolerance);
  f(Field{"thickness_mm", "of the cloth", mm, 0, 10}.without("round"), o.thickness_m);
  f.otherwise({"start", "how it starts"}, o.start);
  f.otherwise({"round", "cut to a disc"}, o.round);
  f.otherwise(Field{"sets", "frame sets"}.plain_name(), o.sets);
  f.otherwise(Field{"picture", "pictures"}.per_flag(), o.pictures);
  f.otherwise({"grids", "of a study", 1, 3}, o.grids);
  f.otherwise({"place_mm", "x and y", mm}, o.place_m);
}

/// Parses the words of a command line; returns the exit code if it ends there, and the message.
std::string parse(std::vector<std::string> words, Options& options) {
  Command app("A program.", "program");
  app.add_record(options);
  words.insert(words.begin(), "program");
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  return message_of([&] {
    const int code = app.parse(static_cast<int>(arguments.size()), arguments.data());
    if (code >= 0) throw usage_error(std::to_string(code), "");
  });
}

TEST(Options, AreReadByTheirDescription) {
  Options o;
  EXPECT_EQ(parse({"a/sheet.ply", "-g", "31", "--thickness-mm", "0.5", "--start", "as-measured",
                   "--sets", "a,b", "c", "--picture", "x,y.png", "--picture", "z.png", "--grids",
                   "5,7", "--place-mm", "1", "2"},
                  o),
            "nothing was thrown");
  EXPECT_EQ(o.sheet, "a/sheet.ply");
  EXPECT_EQ(o.grid, 31);
  EXPECT_EQ(o.thickness_m, 0.5 * mm);
  EXPECT_EQ(o.start, Start::measured);
  EXPECT_THAT(o.sets, ElementsAre("a", "b", "c"));
  EXPECT_THAT(o.pictures, ElementsAre("x,y.png", "z.png"));
  EXPECT_THAT(o.grids, ElementsAre(5, 7));
  EXPECT_EQ(o.place_m, Eigen::Vector2d(1 * mm, 2 * mm));
  EXPECT_EQ(o.tolerance, 1e-3);
  EXPECT_FALSE(o.round);
}

TEST(Options, KeepTheirDefaultsAndTakeFlags) {
  Options o;
  EXPECT_EQ(parse({"s", "--round"}, o), "nothing was thrown");
  EXPECT_TRUE(o.round);
  EXPECT_THAT(o.grids, ElementsAre(11, 21));
}

TEST(Options, AreRefusedWithTheMessagesOfFiles) {
  Options o;
  EXPECT_THAT(parse({"s", "--grid", "3", "--tolerance", "nan", "--start", "flatt"}, o),
              AllOf(HasSubstr("`--grid` is 3\n  to do: give a whole number from 5 to 401"),
                    HasSubstr("`--tolerance` is not a finite number"),
                    HasSubstr("`--start` is `flatt`, which is not known")));
  for (const char* wrong : {"011", "0x11", "2.5", "1e2", "x"})
    EXPECT_THAT(parse({"s", "--grid", wrong}, o), HasSubstr("`--grid` is not a whole number"));
  EXPECT_THAT(parse({"s", "--grid", ""}, o), HasSubstr("--grid is empty\n  to do: give a value"));
  EXPECT_EQ(parse({}, o).front(), '2') << "SHEET is required";
  EXPECT_EQ(parse({"s", "--thickness-mm", "1", "--round"}, o).front(), '2');
  EXPECT_EQ(parse({"s", "--grid", "5", "--grid", "6"}, o).front(), '2');
}

TEST(Options, HelpNamesRangesAndDefaults) {
  Options o;
  testing::internal::CaptureStdout();
  parse({"--help"}, o);
  const std::string help = testing::internal::GetCapturedStdout();
  for (const char* part :
       {"SHEET TEXT REQUIRED", "-g,--grid INT:INT in [5 - 401]=21",
        "--tolerance FLOAT:POSITIVE=0.001", "--start TEXT:{flat,as-measured}=flat",
        "--grids INT:INT from 3=11,21 ...", "Excludes: --round"})
    EXPECT_THAT(help, HasSubstr(part)) << help;
  EXPECT_EQ(flat(value_of(o))[1], (std::pair<std::string, std::string>("grids", "11, 21")));
}

}  // namespace thing
}  // namespace
}  // namespace drape
