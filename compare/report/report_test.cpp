// SPDX-License-Identifier: Apache-2.0
#include "compare/report/report.hpp"

#include <gmock/gmock.h>

#include <regex>
#include <sstream>

#include "compare/report/account.hpp"
#include "compare/test_sheets.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;
using units::mm;

struct Made {
  std::vector<fs::path> files;
  std::string html;
  RunReport report;
};

Made make_report(const fs::path& folder, const Options& options = {}) {
  const Session session = read_session(test::write_example(folder / "A"), {});
  Outcome outcome;
  outcome.arguments = {(folder / "A" / "sheet.ply").string(),
                       "--report",
                       (folder / "report.html").string(),
                       "--threads",
                       "2",
                       "--quiet"};
  compare_session(session, options, outcome);
  Made made;
  made.report = account_of(session, outcome, folder);
  made.files = write_report(folder / "report.html", made.report);
  made.html = read_text(folder / "report.html");
  return made;
}

/// The data of a page: the text of its block.
std::string data_in(const std::string& html) {
  const std::string begin = "<script type=\"application/json\" id=\"report\">";
  const std::size_t from = html.find(begin) + begin.size();
  return html.substr(from, html.find("</script>", from) - from);
}

TEST(Report, IsOneFileThatHoldsTheRecordAndFetchesNothing) {
  const drape::test::TemporaryFolder folder;
  const Made made = make_report(folder.path());
  EXPECT_EQ(one_line(json_value(data_in(made.html))), one_line(value_of(made.report)));
  EXPECT_EQ(pretty(json_value(read_text(folder.path() / "report.json"))),
            pretty(value_of(made.report)));
  EXPECT_EQ(one_line(value_of(read_record<RunReport>(folder.path() / "report.json"))),
            one_line(value_of(made.report)))
      << "a reader has what the writer had";
  for (const char* load : {"<script src", "<link", "@import", "import(", "fetch(", "XMLHttp",
                           "url(", " src=", "href=\"h", "<iframe"})
    EXPECT_THAT(made.html, Not(HasSubstr(load)));
  EXPECT_THAT(made.html, HasSubstr("default-src 'none'"));
  EXPECT_THAT(made.html, HasSubstr(script_hash(page_script())));
}

TEST(Report, NoTextEndsTheDataBlock) {
  const drape::test::TemporaryFolder folder;
  Made made = make_report(folder.path());
  const std::string evil = "</script><script>alert(1)</script><!--";
  made.report.label = made.report.drapes[0].why = evil;
  const std::string html = page_of(evil, "report", value_of(made.report));
  EXPECT_THAT(html, Not(HasSubstr("<script>alert")));
  EXPECT_THAT(one_line(json_value(data_in(html))), HasSubstr("<script>alert(1)"));
}

TEST(Report, HoldsVerdictNumbersMarksGapsAndReasons) {
  const drape::test::TemporaryFolder folder;
  const RunReport report = make_report(folder.path()).report;
  const ReportedDrape& a = report.drapes.at(0);
  EXPECT_TRUE(report.go);
  EXPECT_EQ(a.label, "A");
  ASSERT_TRUE(a.distance && a.budget);
  EXPECT_EQ(a.measurement.marks, 119);
  EXPECT_EQ(a.marks.size(), 121U);
  const auto with_distance = std::count_if(a.marks.begin(), a.marks.end(),
                                           [](const auto& mark) { return mark.distance_m; });
  EXPECT_EQ(with_distance, a.distance->marks);
  double sum = 0;
  for (const ReportedMark& mark : a.marks) {
    EXPECT_NE(mark.gap.empty(), !mark.distance_m) << mark.row << ' ' << mark.col;
    if (!mark.distance_m) continue;
    EXPECT_NEAR((*mark.real_in_world - *mark.virtual_in_world).norm(), *mark.distance_m, 1e-12);
    sum += *mark.distance_m;
  }
  EXPECT_NEAR(sum / a.distance->marks, a.distance->mean_m, 1e-12);
  EXPECT_THAT(one_line(value_of(report)), HasSubstr("seen by one camera only <2>"));
  EXPECT_THAT(one_line(value_of(report)), HasSubstr("residual_force_mN"));
  EXPECT_EQ(a.simulations.size(), 4U);
}

TEST(Report, NamesEveryStepBackToThePictures) {
  const drape::test::TemporaryFolder folder;
  const fs::path target = folder.path() / "target-detections.json";
  write_durable(target, "{}");
  write_durable(folder.path() / "target-detections.run.json",
                R"({"schema": "drapebench/run/1", "program": "drape-detect", "version": "0.2.0",
                    "program_sha256": "0", "arguments": ["recording", "--surface", "target"],
                    "options": {}, "inputs": [], "outputs": [], "started_utc": "", "ended_utc": "",
                    "exit_code": 0})");
  Session session = read_session(test::write_example(folder.path() / "A"), {});
  Outcome outcome;
  outcome.reports.push_back(compare_drape(session.drapes[0].input, {}));
  session.calibrated_by = StepRecord{
      "drape-calib", "0.2.0", {"target-detections.json"}, {{target, sha256_of_file(target)}}};
  const auto commands = [&] {
    return account_of(session, outcome, folder.path()).provenance.commands;
  };
  ASSERT_GE(commands().size(), 2U);
  EXPECT_EQ(commands()[0], "drape-detect recording --surface target");
  EXPECT_THAT(commands()[1], testing::StartsWith("drape-calib "));
  // Another file under that name is not what the calibration came from.
  write_durable(target, "{ }");
  EXPECT_THAT(commands(), Not(testing::Contains(HasSubstr("--surface target"))));
}

TEST(Report, ListsFilesInOneOrderHoweverTheirPathsWereGiven) {
  const drape::test::TemporaryFolder folder;
  Session session = read_session(test::write_example(folder.path() / "A"), {});
  Outcome outcome;
  outcome.reports.push_back(compare_drape(session.drapes[0].input, {}));
  ASSERT_GT(session.read.size(), 2U);
  const auto inputs = [&] {
    std::string text;
    const RunReport made = account_of(session, outcome, folder.path());
    for (const ReportedInput& one : made.provenance.inputs)
      text += one.file + " " + one.sha256 + "\n";
    return text;
  };
  const std::string before = inputs();
  for (auto& [file, sha256] : session.read)
    if (file.extension() == ".ply") file = fs::proximate(file);
  EXPECT_EQ(inputs(), before);
}

TEST(Report, NoGoStandsFirstWithItsReasons) {
  const drape::test::TemporaryFolder folder;
  const RunReport report = make_report(folder.path(), {.min_marks = 200}).report;
  const std::string reason = "A: only 119 marks could be compared, 200 are asked for";
  EXPECT_FALSE(report.go);
  EXPECT_EQ(report.reasons.at(0), reason);
  EXPECT_EQ(report.notes.at(0).severity, Severity::stops);
  EXPECT_EQ(first_line(report), "NO-GO: " + reason);
  EXPECT_THAT(ending_lines(report.drapes[0], 1), HasSubstr("  A  NO-GO "));
}

TEST(Report, EachDrapeHasANameOfItsOwnInFilesAndPage) {
  const drape::test::TemporaryFolder folder;
  Session session = read_session(test::write_example(folder.path() / "A"), {});
  session.drapes.push_back(session.drapes[0]);
  Outcome outcome;
  for (const char* set : {"first laying", "second/laying"}) {
    outcome.reports.push_back(compare_drape(session.drapes[0].input, {}));
    outcome.reports.back().label = outcome.reports.back().name + ", " + set;
  }
  const RunReport report = account_of(session, outcome, folder.path());
  EXPECT_EQ(report.drapes[0].name, "A");
  EXPECT_EQ(report.drapes[1].name, "A_2");
  EXPECT_EQ(report.drapes[1].label, "A, second/laying");
}

TEST(Report, LeavesNoFileOfAnEarlierOneAndEveryOtherFile) {
  const drape::test::TemporaryFolder folder;
  const fs::path beside = folder.path() / "report";
  make_report(folder.path());
  std::vector<fs::path> written,
      earlier = {beside / "A-branches-2.csv", beside / "A-band.svg", beside / "A-overlay-cam0.svg"};
  for (const auto& entry : fs::directory_iterator(beside)) written.push_back(entry.path());
  ASSERT_GT(written.size(), 10U);
  for (const fs::path& file : written)
    earlier.push_back(beside / ("B" + file.filename().string().substr(1)));
  const std::vector<fs::path> others = {beside / "notes.txt", beside / "loads.csv",
                                        beside / "A-loads.csv"};
  for (const auto& files : {earlier, others})
    for (const fs::path& file : files) write_durable(file, "before");
  make_report(folder.path());
  for (const fs::path& file : earlier) EXPECT_FALSE(fs::exists(file)) << file;
  for (const auto& files : {written, others})
    for (const fs::path& file : files) EXPECT_TRUE(fs::exists(file)) << file;
}

TEST(Report, SameInputGivesTheSameBytesInAnotherFolder) {
  const drape::test::TemporaryFolder one, two;
  const Made first = make_report(one.path()), second = make_report(two.path());
  ASSERT_EQ(first.files.size(), second.files.size());
  for (std::size_t i = 0; i < first.files.size(); ++i)
    EXPECT_EQ(read_text(first.files[i]), read_text(second.files[i])) << first.files[i];
}

TEST(Report, PathsAreRelativeAndSettingsWithoutEffectAreLeftOut) {
  const drape::test::TemporaryFolder folder;
  const Made made = make_report(folder.path());
  EXPECT_THAT(made.html, Not(HasSubstr(folder.path().string())));
  EXPECT_THAT(made.report.provenance.commands,
              testing::Contains("drape-compare A/sheet.ply --report report.html"));
}

TEST(Report, FiguresGoByTheirUncertainty) {
  EXPECT_EQ(figure(20.586, 2.151), "20.6");
  EXPECT_EQ(figure(2.151, 2.151), "2.2");
  EXPECT_EQ(figure(1.2237, 0.0996), "1.22") << "0.0996 is 0.10";
  EXPECT_EQ(figure(1.2237, 0.0985), "1.224");
  EXPECT_EQ(figure(1234.4, 250), "1230");
  EXPECT_EQ(figure(0.004, 0.5), "0.00");
  EXPECT_EQ(figure(-0.004, 0.5), "0.00") << "nothing is negative";
  EXPECT_EQ(figure(-3.25, 1), "-3.3") << "ties go away from zero";
  EXPECT_EQ(figure(0.0123456), "0.0123");
  EXPECT_EQ(figure(0), "0");
  EXPECT_EQ(figure(123456), "123456");
  EXPECT_EQ(figure(std::numeric_limits<double>::quiet_NaN(), 1), "not known");
}

TEST(Report, EndsInWholeSentencesOf100ColumnsADrapeWithNameMatchDistanceAndU) {
  const drape::test::TemporaryFolder folder;
  RunReport report = make_report(folder.path()).report;
  report.drapes[0].why = "Beyond";
  for (int k = 0; k < 60; ++k) report.drapes[0].why += fmt::format(" reason-{}", k);
  report.drapes[0].next = "lay it twice more.";
  report.drapes.push_back(report.drapes[0]);
  const std::string text = ending_text(report, first_line(report), "out/report.html");
  std::istringstream stream(text);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  for (const std::string& line : lines) EXPECT_LE(line.size(), 100U) << line;
  EXPECT_EQ(lines.back(), "report  out/report.html");
  const auto first = std::ranges::find_if(
      lines, [](const std::string& line) { return line.starts_with("  A  none "); });
  ASSERT_NE(first, lines.end()) << text;
  const DistanceFigures shown = figures_of(report.drapes[0]);
  EXPECT_THAT(*first, testing::StartsWith("  A  none       " + shown.mean + " mm apart, U "));
  EXPECT_THAT(*first, HasSubstr("U " + shown.expanded + " mm"));
  std::string joined;
  for (auto line = first + 1; line != lines.end(); ++line)
    joined += line->substr(line->find_first_not_of(' ')) + ' ';
  const std::string& why = report.drapes[0].why;
  EXPECT_THAT(joined, testing::StartsWith(why + " Next: lay it twice more. A  none"));
  EXPECT_THAT(joined, HasSubstr(why + " Next: lay it twice more. report "));
  report.drapes[1].match.match = Match::undecided;
  EXPECT_FALSE(is_all_good(report));
  report.drapes[1].match.match = Match::inside;
  EXPECT_TRUE(is_all_good(report));
}

TEST(Report, NotesOfOneKindDifferInDrapeAndNumbersAlone) {
  EXPECT_EQ(
      kind_of_note("triangulate (drape A): doubtful, but measured: 16 marks less certain than "
                   "0.05 mm in space: 0.116 mm at (6, 2)"),
      kind_of_note("triangulate (drape C): doubtful, but measured: 15 marks less certain than "
                   "0.05 mm in space: 0.082 mm at (0, 0)"));
  EXPECT_EQ(
      kind_of_note("A: 14 of 121 marks of the print are not measured (with a label: cam0 89)"),
      "N of N marks of the print are not measured");
  EXPECT_NE(kind_of_note("detect (drape A): cam1 is dim"), kind_of_note("A: placed by another"));
  EXPECT_EQ(kind_of_note("detect (" + std::string(60000, 'a')), "detect");
}

/// Cell of the row that speaks in the .csv beside the report.
std::string cell_in(const fs::path& file, const std::string& column) {
  std::istringstream lines(read_text(file));
  std::string names, row;
  std::getline(lines, names);
  std::getline(lines, row);
  std::istringstream columns(names), cells(row);
  for (std::string name, cell; std::getline(columns, name, ',') && std::getline(cells, cell, ',');)
    if (name == column) return cell;
  return "no column " + column;
}

TEST(Report, FortyFactsAreTheSameOnScreenPageTablesAndStore) {
  const drape::test::TemporaryFolder folder;
  const fs::path store = folder.path() / "results.sqlite";
  const Session session = read_session(test::write_example(folder.path() / "A"), {});
  const Outcome outcome = test::import_run(store, session);
  const RunReport report = account_of(session, outcome, folder.path());
  write_report(folder.path() / "report.html", report);
  const Value page = json_value(data_in(read_text(folder.path() / "report.html")));
  const Value& shown = page.find("drapes")->get_if<Value::List>()->front();
  const ReportedDrape& drape = report.drapes[0];
  const ReportedDistance& d = *drape.distance;
  // To the micrometre, as tables are written.
  const double u = 0.05;
  const std::string screen = detail_text(drape);
  const StoreReader reader(store);
  int facts = 0;
  // Screen: the figures themselves.
  const DistanceFigures figures = figures_of(drape);
  for (const std::string& text :
       {figures.mean + " mm apart", "U " + figures.expanded + " mm", "shape " + figures.shape,
        "place " + figures.place, std::string("none"), drape.simulation,
        std::to_string(drape.measurement.marks) + " measured",
        std::to_string(drape.measurement.gaps) + " gaps",
        figure(*drape.measurement.sigma_median_m / mm, *drape.measurement.sigma_median_m / mm) +
            " mm (median)",
        figure(*drape.measurement.sigma_max_m / mm, *drape.measurement.sigma_max_m / mm) +
            " mm (largest)"}) {
    EXPECT_THAT(screen, HasSubstr(text));
    ++facts;
  }
  // Page: its data, by the same rule.
  const auto of_page = [&](const char* group, const char* key) {
    return shown.find(group)->find(key)->number();
  };
  const auto of_store = [&](const char* column) {
    return std::stod(test::one(
        reader, std::string("SELECT ") + column +
                    " FROM comparison WHERE sha256 = (SELECT headline_sha256 FROM run_drape)"));
  };
  const fs::path csv = folder.path() / "report" / "A-real-vs-virtual.csv";
  struct Fact {
    const char *page, *csv, *store;
    double value_m;
  };
  for (const Fact& fact : {Fact{"mean_mm", "mean_dist_mm", "mean_mm", d.mean_m},
                           {"median_mm", "median_mm", "median_mm", d.median_m},
                           {"rms_mm", "rms_mm", "rms_mm", d.rms_m},
                           {"p95_mm", "p95_mm", "p95_mm", d.p95_m},
                           {"max_mm", "max_mm", "max_mm", d.max_m},
                           {"shape_mm", "shape_mm", "aligned_mean_mm", *d.shape_m},
                           {"sigma_mean_mm", "sigma_mean_mm", "sigma_mean_mm", *d.sigma_mean_m}}) {
    const std::string wanted = figure(fact.value_m / mm, u);
    EXPECT_EQ(figure(of_page("distance", fact.page), u), wanted) << fact.page;
    EXPECT_EQ(figure(std::stod(cell_in(csv, fact.csv)), u), wanted) << fact.csv;
    EXPECT_EQ(figure(of_store(fact.store), u), wanted) << fact.store;
    facts += 3;
  }
  const double expanded_mm = drape.budget->expanded_m / mm;
  const std::string expanded = figure(expanded_mm, expanded_mm);
  EXPECT_EQ(figure(of_page("budget", "expanded_mm"), expanded_mm), expanded);
  EXPECT_EQ(figure(std::stod(test::one(reader, "SELECT expanded_uncertainty_mm FROM run_drape")),
                   expanded_mm),
            expanded);
  EXPECT_EQ(test::one(reader, "SELECT match FROM run_drape"), name_of(drape.match.match));
  EXPECT_EQ(test::one(reader, "SELECT measurement FROM run_drape"), "GO");
  EXPECT_EQ(*shown.find("match")->find("verdict")->get_if<std::string>(), "none");
  EXPECT_EQ(*shown.find("why")->get_if<std::string>(), drape.why);
  EXPECT_EQ(shown.find("marks")->get_if<Value::List>()->size(), drape.marks.size());
  EXPECT_EQ(std::stoi(cell_in(csv, "marks")), d.marks);
  EXPECT_EQ(page.find("go")->get_if<bool>() != nullptr && *page.find("go")->get_if<bool>(), true);
  facts += 9;
  EXPECT_EQ(facts, 40);
}

/// Numbers of the data array of that name.
std::vector<double> array_in(const std::string& vtp, const std::string& name) {
  const std::size_t at = vtp.find("Name=\"" + name + "\""), begin = vtp.find('>', at) + 1;
  std::istringstream text(vtp.substr(begin, vtp.find('<', begin) - begin));
  std::vector<double> values;
  for (double value = 0; text >> value;) values.push_back(value);
  return values;
}

TEST(Report, VtkFilesHoldTheMarksWithTheirDistanceActive) {
  const drape::test::TemporaryFolder folder;
  const RunReport report = make_report(folder.path()).report;
  const ReportedDrape& drape = report.drapes[0];
  const auto marks = static_cast<std::size_t>(drape.distance->marks);
  for (const VtkPart part : {VtkPart::measured, VtkPart::simulated, VtkPart::distance}) {
    const std::string name = "A-" + std::string(drape::name_of(part)) + ".vtp";
    const std::string vtp = read_text(folder.path() / "report" / name);
    const std::size_t ends = part == VtkPart::distance ? 2 : 1;
    EXPECT_THAT(vtp, HasSubstr("<PointData Scalars=\"distance_mm\">"));
    EXPECT_EQ(array_in(vtp, "Points").size(), 3 * ends * marks);
    const std::vector<double> distances = array_in(vtp, "distance_mm");
    ASSERT_EQ(distances.size(), ends * marks);
    double sum = 0;
    for (std::size_t i = 0; i < marks; ++i) sum += distances[i];
    EXPECT_NEAR(sum / static_cast<double>(marks), drape.distance->mean_m / mm, 1e-9);
    const std::vector<double> cells = array_in(vtp, "offsets");
    ASSERT_FALSE(cells.empty());
    EXPECT_EQ(cells.back(), array_in(vtp, "connectivity").size());
    // VTK itself, where it is installed: every point, cell and the active scalar.
    const std::string script =
        "import sys,vtk;r=vtk.vtkXMLPolyDataReader();r.SetFileName(sys.argv[1]);r.Update();"
        "p=r.GetOutput();print(p.GetNumberOfPoints(),p.GetNumberOfCells(),"
        "p.GetPointData().GetScalars().GetName())";
    const fs::path said = folder.path() / "said.txt";
    const std::string command = "python3 -c '" + script + "' '" +
                                (folder.path() / "report" / name).string() + "' > '" +
                                said.string() + "' 2>/dev/null";
    if (std::system("python3 -c 'import vtk' > /dev/null 2>&1") != 0) continue;
    ASSERT_EQ(std::system(command.c_str()), 0);
    EXPECT_EQ(read_text(said),
              std::to_string(ends * marks) + " " + std::to_string(cells.size()) + " distance_mm\n");
  }
}

}  // namespace
}  // namespace drape::compare
