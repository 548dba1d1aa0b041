#pragma once
// What a study found, said once: every renderer draws this, and knows no study.
//
//   study -> Report -> Text, Markdown   terminal, files
//                      report_json.h   JSON, with the study's own result beside it
//                      media/figure.h  PNG, SVG, PDF of its plots
//                      page/report_page.h   HTML
//
// Statistics are in it as numbers and words: a renderer computes none.

#include <optional>
#include <string>
#include <vector>

#include "experiments/report/plot.h"
#include "experiments/report/table.h"

namespace turbidock::report {

// The answer in a word ("pass", "docks more"), what kind of answer that is, and the reason in a
// sentence.
struct Verdict {
  std::string word = {};  // empty: there is nothing to decide
  Tone tone = Tone::kNone;
  std::string reason = {};
  TURBIDOCK_FIELDS(word, tone, reason)
};

// A number that is looked for first, with its unit.
struct Fact {
  std::string label, value;
  std::string note = {};  // how it is meant
  TURBIDOCK_FIELDS(label, value, note)
};

struct Command {
  std::string what;  // it does
  std::string command;
  TURBIDOCK_FIELDS(what, command)
};

// One of sentences, numbers, a table, plots or commands; or several that belong together.
struct Section {
  std::string title;
  std::string note = {};  // how to read it
  std::vector<std::string> lines = {};
  std::vector<Fact> facts = {};
  std::optional<Table> table = {};
  std::vector<Panel> panels = {};
  std::vector<Command> commands = {};
  bool stacked = false;  // its panels share one x axis
  bool wide = false;     // takes the page's whole width, as a section with a table does
  // What a page of this kind fills the section with: of a trial "replay" and "cameras", of a batch
  // "success", "failures", "times", "errors" and "trials". All else shows what is in the section.
  std::string player = {};
  TURBIDOCK_FIELDS(title, note, lines, facts, table, panels, commands, stacked, wide, player)
};

struct Report {
  std::string kind;        // "gate", "comparison", ...: one word a study
  int schema_version = 1;  // of the JSON of this kind
  std::string title;
  std::string build = {};  // the program's that measured it
  Verdict verdict = {};
  std::vector<Fact> facts = {};
  std::vector<std::string> missing = {};  // sentences: what is not shown, and why
  std::vector<Section> sections = {};

  // kind and schema_version are beside it in a document
  TURBIDOCK_FIELDS(title, build, verdict, facts, missing, sections)
};

// For people, without plots.
std::string Text(const Report& report);
std::string Markdown(const Report& report);

}  // namespace turbidock::report
