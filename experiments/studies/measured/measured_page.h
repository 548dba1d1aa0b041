#pragma once
// Measured results are files, and the pages that show them are drawn from the files. A result file
// is CSV whose first lines say where the numbers come from:
//
//   # title: Docking over milk
//   # command: turbidock batch turbidity_sweep --out sweep.db   (may repeat)
//   # build: 207453d
//   # machine: two cores
//   # date: 2026-11-21
//   milk ml/m3,docked
//   0,"30 of 30"
//
// What is not known is written "not recorded". Quotes are RFC 4180's, but a cell ends on its line.
// A page shows the table between two lines of its own:
//
//   <!-- measured docking_over_milk -->
//   <!-- end measured -->
//
// Lines in fenced code blocks are no such lines. Nothing here touches a file but LoadTables.

#include <map>
#include <string>
#include <vector>

namespace turbidock::measured {

struct Table {
  std::string title;
  std::vector<std::string> commands;
  std::string build, machine, date;
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows;  // each as long as `columns`
};

using Tables = std::map<std::string, Table>;  // by the file's name without .csv

// Throws ConfigError "FILE:LINE: ..." for what is malformed or missing.
Table ParseTable(const std::string& text, const std::string& file);

// Every *.csv of a folder.
Tables LoadTables(const std::string& folder);

// The lines that a page shows: a Markdown table and, below it, where it comes from.
std::vector<std::string> MarkdownLines(const Table& table);

// The page with each table drawn anew and every other byte as it was. Throws ConfigError
// "PAGE:LINE: ..." for a table of no such name and for a marker without its partner.
std::string DrawPage(const std::string& text, const std::string& page, const Tables& tables);

// A sentence for each table of the page that differs from its file: page, line, table, what the
// page says and what the file does. Throws as DrawPage does.
std::vector<std::string> Differences(const std::string& text, const std::string& page,
                                     const Tables& tables);

// The tables that a page shows, in its order. Throws as DrawPage does.
std::vector<std::string> TablesShown(const std::string& text, const std::string& page);

}  // namespace turbidock::measured
