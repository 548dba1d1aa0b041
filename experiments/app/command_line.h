#pragma once
// The program's command line. CLI11 does the work behind it, in one file: its header takes longer
// to compile than any command.

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace turbidock::app {

enum ExitCode {
  kExitDone = 0,
  kExitCheckFailed = 1,     // --expect, selftest --physics, gate
  kExitBadInput = 2,        // command line, file, key
  kExitInconclusive = 3,    // gate: its trials are spent
  kExitSimulatorFault = 4,  // this machine cannot simulate or draw
  kExitMismatch = 5         // merge, verify, replay: results differ that should not
};

using Command = std::function<int()>;  // returns the exit code

// An option, a flag or a positional argument. Each call returns the option, to go on with.
class Option {
 public:
  explicit Option(CLI::Option* option) : option_(option) {}

  Option Required();
  Option Type(const std::string& name);  // of its value, for the help: FILE, KEY=VALUE
  Option ShowsDefault();
  Option Group(const std::string& title);  // in the help
  Option Between(int low, int high);       // both allowed
  Option Between(double low, double high);
  Option Positive();
  Option NotNegative();
  Option OneOf(const std::vector<std::string>& values);
  Option ListOf(char separator);  // values in one argument
  Option OneValueEach();          // may be repeated, one value each time
  Option Excludes(Option other);
  Option Needs(Option other);
  // `problem` says what is wrong with a value, or nothing.
  Option Check(const std::function<std::string(const std::string&)>& problem,
               const std::string& type);

 private:
  CLI::Option* option_;
};

class Subcommand {
 public:
  Subcommand(CLI::App* app, Command* chosen) : app_(app), chosen_(chosen) {}

  // An option ("--out", or "-o,--out") or a positional argument ("scenario"), read into `target`,
  // which must live as long as what Runs is given. T: text, a number, an optional or a list of
  // them.
  template <class T>
  Option Add(const std::string& name, T& target, const std::string& doc);
  Option Flag(const std::string& name, bool& target, const std::string& doc);
  void Footer(const std::string& text);
  void Runs(Command command);

 private:
  CLI::App* app_;
  Command* chosen_;
};

class CommandLine {
 public:
  CommandLine(const std::string& name, const std::string& description);
  ~CommandLine();
  CommandLine(const CommandLine&) = delete;
  CommandLine& operator=(const CommandLine&) = delete;

  Subcommand Add(const std::string& name, const std::string& doc);
  Option Flag(const std::string& name, bool& target, const std::string& doc);
  void Footer(const std::string& text);
  std::string Help() const;

  // Nothing when the line is sound; else what to exit with: help was asked for and printed, or the
  // line is wrong and stderr says how.
  std::optional<int> Parse(int argc, char** argv);
  // Of the subcommand on the line; empty without one.
  const Command& chosen() const { return chosen_; }

 private:
  std::unique_ptr<CLI::App> app_;
  Command chosen_;
};

}  // namespace turbidock::app
