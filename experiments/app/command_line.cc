#include "experiments/app/command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdint>

namespace turbidock::app {
namespace {

template <class T>
constexpr bool kIsList = false;
template <class T>
constexpr bool kIsList<std::vector<T>> = true;
template <class T>
constexpr bool kHoldsDouble = std::is_same_v<T, double> || std::is_same_v<T, std::vector<double>> ||
                              std::is_same_v<T, std::optional<double>>;

// CLI11 reads "nan" and "inf", which no range of its own refuses.
std::string NotFinite(const std::string& value) {
  double number = 0;
  const bool is_number = CLI::detail::lexical_cast(value, number);
  return is_number && !std::isfinite(number) ? value + " is not a finite number" : "";
}

}  // namespace

Option Option::Required() {
  option_->required()->default_str("");
  return *this;
}

Option Option::Group(const std::string& title) {
  option_->group(title);
  return *this;
}

Option Option::Between(double low, double high) {
  const std::string range = fmt::format("{} to {}", low, high);
  const auto problem = [low, high, range](const std::string& value) -> std::string {
    double number = 0;
    if (CLI::detail::lexical_cast(value, number) && number >= low && number <= high) return "";
    return value + " must be a number from " + range;
  };
  option_->check(CLI::Validator(problem, range));
  return *this;
}

Option Option::Positive() {
  option_->check(CLI::PositiveNumber);
  return *this;
}

Option Option::NotNegative() {
  option_->check(CLI::NonNegativeNumber);
  return *this;
}

Option Option::OneOf(const std::vector<std::string>& values) {
  option_->check(CLI::IsMember(values));
  return *this;
}

Option Option::Excludes(Option other) {
  option_->excludes(other.option_);
  return *this;
}

Option Option::Needs(Option other) {
  option_->needs(other.option_);
  return *this;
}

Option Option::Check(const std::function<std::string(const std::string&)>& problem) {
  option_->check([problem](const std::string& value) { return problem(value); });
  return *this;
}

template <class T>
Option Subcommand::Add(const std::string& name, T& target, const std::string& doc) {
  const size_t space = name.find(' ');
  CLI::Option* const option = app_->add_option(name.substr(0, space), target, doc);
  if (space != std::string::npos) option->type_name(name.substr(space + 1));
  if (target != T{}) option->capture_default_str();
  if constexpr (kIsList<T>) {
    if (name.ends_with(",..."))
      option->delimiter(',');
    else if (name.starts_with("-"))
      option->allow_extra_args(false);
  }
  if constexpr (kHoldsDouble<T>) option->check(NotFinite);
  return Option(option);
}

#define TURBIDOCK_OPTION(...) \
  template Option Subcommand::Add(const std::string&, __VA_ARGS__&, const std::string&)
TURBIDOCK_OPTION(std::string);
TURBIDOCK_OPTION(int);
TURBIDOCK_OPTION(int64_t);
TURBIDOCK_OPTION(uint32_t);
TURBIDOCK_OPTION(uint64_t);
TURBIDOCK_OPTION(double);
TURBIDOCK_OPTION(std::optional<std::string>);
TURBIDOCK_OPTION(std::optional<int>);
TURBIDOCK_OPTION(std::optional<int64_t>);
TURBIDOCK_OPTION(std::optional<double>);
TURBIDOCK_OPTION(std::vector<std::string>);
TURBIDOCK_OPTION(std::vector<int64_t>);
TURBIDOCK_OPTION(std::vector<double>);
#undef TURBIDOCK_OPTION

Option Subcommand::Flag(const std::string& name, bool& target, const std::string& doc) {
  return Option(app_->add_flag(name, target, doc));
}

void Subcommand::Footer(const std::string& text) { app_->footer(text); }

void Subcommand::Hidden() { app_->group(""); }

Option Subcommand::AddSet(std::vector<std::string>& assignments, const std::string& doc) {
  return Add("--set KEY=VALUE", assignments, doc + "; may be repeated");
}

Option Subcommand::AddSeed(std::string& seed) {
  return Add("--seed", seed, "Root of all randomness; as --set seed=N");
}

Option Subcommand::AddWorkers(int& workers, const std::string& doc) {
  return Add("--workers", workers, doc).Between(1, 1024);
}

void Subcommand::AddJson(bool& json) { Flag("--json", json, "Print the result as JSON on stdout"); }

void Subcommand::AddQuiet(bool& quiet) {
  Flag("--quiet", quiet, "Print nothing on stderr but errors");
}

CommandLine::CommandLine(const std::string& name, const std::string& description,
                         const trial::Plugins& plugins)
    : plugins_(plugins), app_(std::make_unique<CLI::App>(description)) {
  app_->name(name);
  app_->set_help_all_flag("--help-all", "Help of every subcommand");
  app_->require_subcommand(0, 1);
}

CommandLine::~CommandLine() = default;

Subcommand CommandLine::AddCommand(const std::string& name, const std::string& doc,
                                   std::function<int()> run) {
  CLI::App* const app = app_->add_subcommand(name, doc);
  app->callback([this, run = std::move(run)] { chosen_ = run; });
  return Subcommand(app);
}

void CommandLine::Add(const std::string& name, const std::string& doc, int (*run)()) {
  AddCommand(name, doc, run);
}

Subcommand CommandLine::Program() { return Subcommand(app_.get()); }

std::string CommandLine::Help() const { return app_->help(); }

std::optional<int> CommandLine::Parse(int argc, char** argv) {
  try {
    app_->parse(argc, argv);
    return std::nullopt;
  } catch (const CLI::ParseError& error) {
    // Help is an "error" of CLI11's with code 0.
    return app_->exit(error) == 0 ? kExitDone : kExitBadInput;
  }
}

std::optional<int> CommandLine::Run() const {
  if (!chosen_) return std::nullopt;
  return chosen_();
}

}  // namespace turbidock::app
