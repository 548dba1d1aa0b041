#include "experiments/app/command_line.h"

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <utility>

namespace turbidock::app {

Option Option::Required() {
  option_->required();
  return *this;
}

Option Option::Type(const std::string& name) {
  option_->type_name(name);
  return *this;
}

Option Option::ShowsDefault() {
  option_->capture_default_str();
  return *this;
}

Option Option::Group(const std::string& title) {
  option_->group(title);
  return *this;
}

Option Option::Between(int low, int high) {
  option_->check(CLI::Range(low, high));
  return *this;
}

Option Option::Between(double low, double high) {
  option_->check(CLI::Range(low, high));
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

Option Option::ListOf(char separator) {
  option_->delimiter(separator);
  return *this;
}

Option Option::OneValueEach() {
  option_->allow_extra_args(false);
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

Option Option::Check(const std::function<std::string(const std::string&)>& problem,
                     const std::string& type) {
  option_->check(CLI::Validator([problem](std::string& value) { return problem(value); }, type));
  return *this;
}

template <class T>
Option Subcommand::Add(const std::string& name, T& target, const std::string& doc) {
  return Option(app_->add_option(name, target, doc));
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

void Subcommand::Runs(Command command) {
  app_->callback([chosen = chosen_, command = std::move(command)] { *chosen = command; });
}

CommandLine::CommandLine(const std::string& name, const std::string& description)
    : app_(std::make_unique<CLI::App>(description)) {
  app_->name(name);
  app_->set_help_all_flag("--help-all", "Help of every subcommand");
  app_->require_subcommand(0, 1);
}

CommandLine::~CommandLine() = default;

Subcommand CommandLine::Add(const std::string& name, const std::string& doc) {
  return {app_->add_subcommand(name, doc), &chosen_};
}

Option CommandLine::Flag(const std::string& name, bool& target, const std::string& doc) {
  return Option(app_->add_flag(name, target, doc));
}

void CommandLine::Footer(const std::string& text) { app_->footer(text); }

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

}  // namespace turbidock::app
