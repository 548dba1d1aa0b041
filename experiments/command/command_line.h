#pragma once
// The program's command line. CLI11 does the work behind it, in one file: its header takes longer
// to compile than any command.

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "experiments/trial/plugins.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace turbidock::command {

enum ExitCode {
  kExitDone = 0,
  kExitCheckFailed = 1,     // --expect, gate
  kExitBadInput = 2,        // command line, file, key
  kExitInconclusive = 3,    // gate: its trials are spent
  kExitSimulatorFault = 4,  // this machine cannot simulate or draw
  kExitMismatch = 5         // merge, replay: results differ that should not
};

// An option, a flag or a positional argument. Each call returns the option, to go on with.
class Option {
 public:
  explicit Option(CLI::Option* option, bool has_commas = false)
      : option_(option), has_commas_(has_commas) {}

  Option Required();
  Option Group(const std::string& title);   // in the help
  Option Between(double low, double high);  // both allowed
  Option Positive();
  Option NotNegative();
  Option OneOf(const std::vector<std::string>& values);
  Option Excludes(Option other);
  Option Needs(Option other);
  // `problem` says what is wrong with a value, or nothing; `allowed` is what the help says of it.
  Option Check(const std::function<std::string(const std::string&)>& problem,
               const std::string& allowed = "");

 private:
  CLI::Option* option_;
  bool has_commas_;  // between the values in an argument
};

class Subcommand {
 public:
  explicit Subcommand(CLI::App* app) : app_(app) {}

  // An option ("--frames", or "--out FILE" with what the help calls its value) or a positional
  // argument ("scenario"), read into `target`, which must live as long as the command line. T:
  // text, which is not empty, a number (decimal, finite), an optional or a list of them; a list has
  // its values, all different, in one argument if the name ends in ",...", else an option of it is
  // given once for each. The help shows the target's value as the default, unless it is empty or 0.
  template <class T>
  Option Add(const std::string& name, T& target, const std::string& doc);
  Option Flag(const std::string& name, bool& target, const std::string& doc);
  void Footer(const std::string& text);
  void Hidden();  // in no help

  // Options that many subcommands have.
  Option AddSet(std::vector<std::string>& assignments, const std::string& doc);
  Option AddGains(std::string& file);
  Option AddSeed(std::string& seed);  // a whole number, as written; see SetSeed
  Option AddWorkers(int& workers, const std::string& doc);
  // --figure: a file that can be one, on a machine that can draw (both asked while the line is
  // read). `doc` says what is drawn.
  Option AddFigure(std::string& file, const std::string& doc);
  void AddJson(bool& json);
  void AddQuiet(bool& quiet);
  void AddAnew(bool& anew);

 private:
  CLI::App* app_;
};

class CommandLine {
 public:
  // `plugins`: for the subcommands, each of which takes them along in its arguments.
  CommandLine(const std::string& name, const std::string& description,
              const trial::Plugins& plugins = {});
  ~CommandLine();
  CommandLine(const CommandLine&) = delete;
  CommandLine& operator=(const CommandLine&) = delete;

  // A subcommand and its arguments, whose values `run` is called with; it returns the exit code.
  template <class Arguments>
  std::pair<Subcommand, Arguments&> Add(const std::string& name, const std::string& doc,
                                        int (*run)(const Arguments&)) {
    auto arguments = std::make_shared<Arguments>();
    return {AddCommand(name, doc, [arguments, run] { return run(*arguments); }), *arguments};
  }
  Subcommand Program();  // for what stands before any subcommand
  std::string Help() const;
  const trial::Plugins& plugins() const { return plugins_; }

  // Nothing when the line is sound; what to exit with when help was asked for and is printed;
  // ConfigError when the line is wrong.
  std::optional<int> Parse(int argc, char** argv);
  // Runs the subcommand on the line; nothing without one.
  std::optional<int> Run() const;

 private:
  std::vector<std::string> Known() const;
  Subcommand AddCommand(const std::string& name, const std::string& doc, std::function<int()> run);

  trial::Plugins plugins_;
  std::unique_ptr<CLI::App> app_;
  std::function<int()> chosen_;
};

// Two lines that use a command, for the end of its help; nothing for one that is not known.
std::string ExamplesOf(const std::string& command);

// Adds what --seed gives to what --set does. ConfigError where both give it.
void SetSeed(const std::string& seed, std::vector<std::string>* assignments);

}  // namespace turbidock::command
