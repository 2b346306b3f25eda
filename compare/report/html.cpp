// SPDX-License-Identifier: Apache-2.0
#include "compare/report/html.hpp"

#include <fmt/format.h>

#include "compare/report/viewer.hpp"

namespace drape::compare {
namespace {

constexpr const char* kStyle = R"css(
:root { --ink: #1c2430; --soft: #5a6572; --line: #dde2e8; --paper: #ffffff; --go: #0b6b3a; --stop: #a3231c; }
* { box-sizing: border-box; }
html { color-scheme: light; -webkit-text-size-adjust: 100%; }
body { margin: 0; background: var(--paper); color: var(--ink);
  font: 16px/1.55 system-ui, -apple-system, "Segoe UI", Roboto, "Noto Sans", "DejaVu Sans", sans-serif; }
main { max-width: 72rem; margin: 0 auto; padding: 0 1.25rem 4rem; }
h1 { font-size: 1.05rem; font-weight: 600; letter-spacing: .02em; color: var(--soft); margin: 1.6rem 0 .6rem; }
h2 { font-size: 1.7rem; line-height: 1.2; margin: 3.5rem 0 .3rem; padding-top: 1.2rem; border-top: 2px solid var(--ink); }
h3 { font-size: 1.12rem; margin: 2.2rem 0 .5rem; }
p { max-width: 46rem; margin: .5rem 0; }
.soft { color: var(--soft); }
.verdict { border-left: .5rem solid; padding: .9rem 1.1rem; margin: 0 0 1.2rem; font-size: 1.2rem; line-height: 1.4; }
.verdict strong { display: block; font-size: 2rem; letter-spacing: .03em; line-height: 1.15; }
.verdict ul { margin: .4rem 0 0; padding-left: 1.2rem; font-size: 1rem; }
.go { border-color: var(--go); background: #eef7f1; } .go strong { color: var(--go); }
.stop { border-color: var(--stop); background: #fcf0ef; } .stop strong { color: var(--stop); }
.tag { font-weight: 700; } .tag-go { color: var(--go); } .tag-stop { color: var(--stop); }
.scroll { overflow-x: auto; margin: .3rem 0 1rem; }
table { border-collapse: collapse; font-size: .92rem; font-variant-numeric: tabular-nums; }
caption { text-align: left; font-weight: 600; padding: 0 0 .35rem; }
th, td { padding: .3rem .8rem .3rem 0; text-align: left; vertical-align: baseline; border-bottom: 1px solid var(--line); }
th { font-weight: 600; color: var(--soft); border-bottom: 1.5px solid var(--ink); vertical-align: bottom; }
table:not(.dense) td.k { white-space: nowrap; }
td.n, th.n { text-align: right; padding-left: .9rem; }
tr.best td { font-weight: 700; background: #f3f6fa; }
table.dense { font-size: .8rem; } table.dense td, table.dense th { padding: .12rem .5rem .12rem 0; }
.columns { display: grid; grid-template-columns: repeat(auto-fit, minmax(19rem, 1fr)); gap: .5rem 2.5rem; align-items: start; }
.photos { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(24rem, 100%), 1fr)); gap: 1rem; }
.marks { columns: 20rem auto; column-gap: 2rem; } .marks td { vertical-align: middle; }
figure { margin: 0 0 1rem; break-inside: avoid; }
.turn canvas { display: block; width: 100%; max-width: 62rem; height: auto; touch-action: none; cursor: grab; background: #f5f7f9; border-radius: 4px; }
.turn canvas:focus-visible, button:focus-visible, summary:focus-visible { outline: 3px solid #0072b2; outline-offset: 2px; }
.keys { display: flex; flex-wrap: wrap; gap: .5rem; align-items: center; padding-top: .4rem; font-size: .88rem; }
.keys button { font: inherit; padding: .15rem .7rem; border: 1.5px solid var(--ink); border-radius: 4px; background: #fff; color: var(--ink); }
.keys button[aria-pressed="true"] { background: var(--ink); color: #fff; }
figure td.crop { white-space: nowrap; padding: 1px 0 0 .4rem; } figure td.crop svg { display: inline-block; vertical-align: middle; width: 1.65rem; height: 1.65rem; margin-right: 1px; background: #e3e6ea; border-radius: 3px; }
summary { cursor: pointer; font-weight: 600; padding: .3rem 0; }
figure svg { display: block; width: 100%; height: auto; }
.chart { max-width: 46rem; }
.photos svg { border-radius: 4px; }
figcaption { font-size: .88rem; color: var(--soft); padding-top: .35rem; max-width: 46rem; }
pre, code { font-family: ui-monospace, "Cascadia Mono", "DejaVu Sans Mono", Consolas, monospace; font-size: .8rem; }
pre { background: #f5f7f9; padding: .8rem 1rem; white-space: pre-wrap; overflow-wrap: anywhere; line-height: 1.5; border-radius: 4px; }
td code { overflow-wrap: anywhere; }
@media (max-width: 40rem) { body { font-size: 15px; } h2 { font-size: 1.4rem; } th, td { padding-right: .55rem; } .verdict strong { font-size: 1.6rem; } }
@page { margin: 12mm; }  /* A4 and Letter: no size is asked for */
@media print {  /* at most two pages, and three a drape */
  html { font-size: 8.5pt; } body { font-size: 1rem; } main { max-width: none; padding: 0; }
  table.dense, .marks, .marks + p, .chart, .chart + p + figure, .scroll + p.soft, #provenance { display: none; } h3:has(+ .scroll > table.dense), .scroll:has(> table.dense) + p { display: none; }
  #calibration::after { content: "Left out on paper: charts of hem, strain, residual and curves, tables of single marks, gaps, certificates and values, commands and hashes. They stand in the report's file, and as CSV in the folder report beside it."; }
  main > section:first-of-type > h2 { break-before: auto; margin-top: 1.5rem; }
  .certificate { break-after: page; } p { max-width: none; margin: .15rem 0; line-height: 1.35; orphans: 3; widows: 3; } p.soft { font-size: .8rem; }
  h2 { break-before: page; border-top: 0; margin-top: 0; } h3 { break-after: avoid; margin: .6rem 0 .15rem; } h3 + p { break-after: avoid; }
  table { font-size: 7.5pt; } th, td { padding-top: .08rem; padding-bottom: .08rem; line-height: 1.3; } tr, figure { break-inside: avoid; }
  .scroll { overflow: visible; margin: .1rem 0 .3rem; }
  .turn { display: none; } figure { margin: 0 0 .3rem; } figure svg { max-height: 38mm; } figcaption { max-width: none; font-size: .8rem; line-height: 1.25; padding-top: .1rem; }
  .photos { grid-template-columns: repeat(4, 1fr); gap: .3rem; }
  .verdict { border: 1.5pt solid; border-left-width: 6pt; } * { print-color-adjust: exact; -webkit-print-color-adjust: exact; }
}
)css";

std::string row_of(const std::string& tag, const std::string& attribute,
                   const std::vector<std::string>& cells, const std::vector<bool>& numeric) {
  std::string text;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    // A few words stay on one line; sentences may break.
    const bool whole = tag == "td" && cells[i].size() <= 26 && cells[i].find(' ') != cells[i].npos;
    text += fmt::format("<{0}{1}{2}>{3}</{0}>", tag, attribute,
                        numeric[i] ? " class=\"n\""
                        : whole    ? " class=\"k\""
                                   : "",
                        xml(cells[i]));
  }
  return text;
}

std::string class_of(const std::string& name) {
  return name.empty() ? "" : " class=\"" + name + "\"";
}

}  // namespace

std::string html_page(const std::string& title, const std::string& body,
                      const std::vector<std::string>& scripts) {
  std::string policy = "default-src 'none'; img-src data:; style-src 'unsafe-inline'", text;
  if (!scripts.empty()) policy += "; script-src";
  for (const std::string& script : scripts) {
    policy += " '" + script_hash(script) + "'";
    text += "<script>" + script + "</script>\n";
  }
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
         "<meta http-equiv=\"Content-Security-Policy\" content=\"" +
         policy +
         "\"/>\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n"
         "<title>" +
         xml(title) + "</title>\n<style>" + kStyle + "</style>\n</head>\n<body>\n<main>\n" + body +
         "</main>\n" + text + "</body>\n</html>\n";
}

std::string html_paragraph(const std::string& text) {
  return "<p>" + xml(text) + "</p>\n";
}

std::string html_note(const std::string& text) {
  return "<p class=\"soft\">" + xml(text) + "</p>\n";
}

std::string html_table(const Table& table, const std::string& css_class,
                       const PictureColumn& pictures) {
  if (table.rows.empty()) return {};
  std::string text = "<div class=\"scroll\"><table" + class_of(css_class) + ">";
  if (!table.title.empty()) text += "<caption>" + xml(table.title) + "</caption>";
  text += "<thead><tr>" +
          row_of("th", " scope=\"col\"", table.headings.empty() ? table.names : table.headings,
                 table.numeric) +
          (pictures.cells.empty() ? "" : "<th scope=\"col\">" + xml(pictures.head) + "</th>") +
          "</tr></thead><tbody>\n";
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    text += (table.marked_row == i ? "<tr class=\"best\">" : "<tr>") +
            row_of("td", "", table.rows[i], table.numeric);
    if (i < pictures.cells.size()) text += "<td class=\"crop\">" + pictures.cells[i] + "</td>";
    text += "</tr>\n";
  }
  return text + "</tbody></table></div>\n";
}

std::string html_figure(const Figure& figure, const std::string& css_class) {
  return "<figure" + class_of(css_class) + ">\n" + figure.svg + "<figcaption>" +
         xml(figure.caption) + "</figcaption></figure>\n";
}

}  // namespace drape::compare
