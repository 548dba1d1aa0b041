#include "experiments/command/command_line.h"

#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <boost/algorithm/string/split.hpp>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>

#include "experiments/config/nearest_name.h"
#include "experiments/media/figure.h"
#include "experiments/trial/scenario.h"
#include "sim/base/fields.h"

namespace turbidock::command {
namespace {

template <class T>
constexpr bool kIsList = false;
template <class T>
constexpr bool kIsList<std::vector<T>> = true;

// Reads a value as it is written; each says what is wrong with it, or nothing.
std::string Read(const std::string& text, std::string* value) {
  *value = text;
  return text.empty() ? "has an empty value" : "";
}

// Decimal and finite, as in YAML: 010 is ten.
template <class Number>
std::string Read(const std::string& text, Number* value) {
  constexpr bool is_whole = std::is_integral_v<Number>;
  const bool has_plus = text.starts_with('+') && !text.starts_with("+-");
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data() + (has_plus ? 1 : 0), end, *value);
  if (error == std::errc::invalid_argument || stop != end)
    return fmt::format("'{}' must be a {}{}", text, is_whole ? "whole number" : "number",
                       std::is_unsigned_v<Number> ? " without a sign" : "");
  if (error != std::errc()) {
    using Limits = std::numeric_limits<Number>;
    return is_whole ? fmt::format("{} must be from {} to {}", text, Limits::min(), Limits::max())
                    : text + " is too large or too small a number";
  }
  return std::isfinite(static_cast<double>(*value)) ? "" : text + " is not a finite number";
}

template <class T>
std::string Read(const std::string& text, std::optional<T>* value) {
  return Read(text, &value->emplace());
}

template <class T>
std::string Read(const std::string& text, std::vector<T>* values) {
  return Read(text, &values->emplace_back());
}

template <class T>
std::string Problem(const std::string& text) {
  T value{};
  return Read(text, &value);
}

std::vector<std::string> ValuesIn(const std::string& argument, bool has_commas) {
  if (!has_commas) return {argument};
  std::vector<std::string> values;
  return boost::split(values, argument, [](char c) { return c == ','; });
}

// What is wrong with a number that is not in a range, which is so in words.
auto NotIn(const Range& range, const std::string& words) {
  return [range, words](const std::string& value) {
    double number = 0;
    const bool is_in = Read(value, &number).empty() && range.Contains(number);
    return is_in ? "" : value + " must be " + words;
  };
}

// CLI11's help without what an option excludes: that is said of a line that has both.
class HelpFormat : public CLI::Formatter {
  std::string make_option_opts(const CLI::Option* option) const override {
    const std::string text = CLI::Formatter::make_option_opts(option);
    return text.substr(0, text.find(" Excludes:"));
  }
};

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
  return Check(NotIn(InRange(low, high), "a number from " + range), range);
}

Option Option::Positive() { return Check(NotIn(Above(0), "above 0"), "above 0"); }

Option Option::NotNegative() { return Check(NotIn(AtLeast(0), "at least 0"), "at least 0"); }

Option Option::OneOf(const std::vector<std::string>& values) {
  const auto problem = [values](const std::string& value) {
    const bool is_one = std::find(values.begin(), values.end(), value) != values.end();
    return is_one ? "" : fmt::format("'{}' must be one of {}", value, fmt::join(values, ", "));
  };
  return Check(problem, fmt::format("{{{}}}", fmt::join(values, ",")));
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
                     const std::string& allowed) {
  const auto first_problem = [problem, has_commas = has_commas_](const std::string& argument) {
    std::string found;
    for (const std::string& value : ValuesIn(argument, has_commas))
      if (found.empty()) found = problem(value);
    return found;
  };
  option_->check(CLI::Validator(first_problem, allowed));
  return *this;
}

// CLI11's own reading takes 010 for eight, what is too large for the largest, and leaves out what
// is empty.
template <class T>
Option Subcommand::Add(const std::string& name, T& target, const std::string& doc) {
  const size_t space = name.find(' ');
  const bool has_commas = name.ends_with(",...");
  const std::string flag = name.substr(0, space);
  const auto read = [&target, has_commas, flag](const CLI::results_t& arguments) {
    target = T{};
    for (const std::string& argument : arguments)
      for (const std::string& value : ValuesIn(argument, has_commas)) {
        Read(value, &target);
        if constexpr (kIsList<T>)
          if (has_commas &&
              std::find(target.begin(), target.end() - 1, target.back()) + 1 != target.end())
            throw CLI::ValidationError(flag, "'" + value + "' is given twice");
      }
    return true;
  };
  CLI::Option* const option =
      app_->add_option(flag, read, doc, /*defaulted=*/target != T{},
                       [&target] { return CLI::detail::checked_to_string<T, T>(target); });
  const std::string type = CLI::detail::type_name<T>();
  option->type_name(space != std::string::npos ? name.substr(space + 1)
                    : type == "UINT"           ? "INT"
                                               : type);
  if constexpr (kIsList<T>) {
    option->expected(CLI::detail::expected_max_vector_size);
    option->allow_extra_args(!name.starts_with("-"));
  }
  return Option(option, has_commas).Check(Problem<T>);
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
TURBIDOCK_OPTION(std::vector<std::string>);
TURBIDOCK_OPTION(std::vector<double>);
#undef TURBIDOCK_OPTION

Option Subcommand::Flag(const std::string& name, bool& target, const std::string& doc) {
  return Option(app_->add_flag(name, target, doc)->disable_flag_override());
}

void Subcommand::Footer(const std::string& text) {
  app_->footer(text + "\n\n" + app_->get_footer());
}

void Subcommand::Hidden() { app_->group(""); }

Option Subcommand::AddSet(std::vector<std::string>& assignments, const std::string& doc) {
  return Add("--set KEY=VALUE", assignments, doc + "; may be repeated");
}

Option Subcommand::AddGains(std::string& file) {
  return Add("--gains", file, "Gains file: overrides the scenarios; --set overrides it");
}

Option Subcommand::AddSeed(std::string& seed) {
  return Add("--seed INT", seed, "Root of all randomness; as --set trial.seed=N")
      .Check(Problem<int64_t>)
      .NotNegative();
}

Option Subcommand::AddWorkers(int& workers, const std::string& doc) {
  return Add("--workers", workers, doc).Between(1, 1024);
}

Option Subcommand::AddFigure(std::string& file, const std::string& doc) {
  const auto problem = [](const std::string& path) -> std::string {
    try {
      media::RequireFigurePath(path);
    } catch (const ConfigError& error) {
      return error.what();
    }
    media::RequireFigures();
    return "";
  };
  return Add("--figure FILE", file, doc + ": .png, .svg or .pdf").Check(problem);
}

void Subcommand::AddJson(bool& json) { Flag("--json", json, "Print the result as JSON on stdout"); }

void Subcommand::AddQuiet(bool& quiet) {
  Flag("--quiet", quiet, "Print nothing on stderr but errors");
}

void Subcommand::AddAnew(bool& anew) {
  Flag("--anew", anew,
       "Of trials that are kept, run those anew whose scenario, files or program changed");
}

CommandLine::CommandLine(const std::string& name, const std::string& description,
                         const trial::Plugins& plugins)
    : plugins_(plugins), app_(std::make_unique<CLI::App>(description)) {
  app_->name(name);
  app_->set_help_all_flag("--help-all", "Help of every subcommand");
  app_->formatter(std::make_shared<HelpFormat>());
  app_->require_subcommand(0, 1);
}

CommandLine::~CommandLine() = default;

Subcommand CommandLine::AddCommand(const std::string& name, const std::string& doc,
                                   std::function<int()> run) {
  CLI::App* const app = app_->add_subcommand(name, doc);
  app->callback([this, run = std::move(run)] { chosen_ = run; });
  app->footer(ExamplesOf(name));
  return Subcommand(app);
}

Subcommand CommandLine::Program() { return Subcommand(app_.get()); }

std::string CommandLine::Help() const { return app_->help(); }

std::optional<int> CommandLine::Parse(int argc, char** argv) {
  try {
    app_->parse(argc, argv);
    return std::nullopt;
  } catch (const CLI::Success& help) {
    return app_->exit(help);
  } catch (const CLI::ExtrasError&) {  // which has them in the wrong order
    const std::vector<std::string> extra = app_->remaining(/*recurse=*/true);
    const std::string meant = config::DidYouMean(extra[0], Known());
    throw ConfigError(fmt::format("not expected here: {}{}", fmt::join(extra, " "),
                                  meant.empty() ? "; see --help" : meant));
  } catch (const CLI::ParseError& error) {
    throw ConfigError(std::string(error.what()) + "; see --help");
  }
}

// What the line's first word, or a word after that, may be.
std::vector<std::string> CommandLine::Known() const {
  std::vector<std::string> names;
  for (const CLI::App* chosen : app_->get_subcommands())
    for (const CLI::Option* option : chosen->get_options()) names.push_back(option->get_name());
  if (names.empty())
    for (const CLI::App* one : app_->get_subcommands([](const CLI::App*) { return true; }))
      names.push_back(one->get_name());
  return names;
}

std::optional<int> CommandLine::Run() const {
  if (!chosen_) return std::nullopt;
  return chosen_();
}

void SetSeed(const std::string& seed, std::vector<std::string>* assignments) {
  if (seed.empty()) return;
  for (const std::string& given : *assignments)
    if (trial::Gives(given, "trial.seed"))
      throw ConfigError(fmt::format("--seed {} and --set {}: give one of them", seed, given));
  assignments->push_back("trial.seed=" + seed);
}

}  // namespace turbidock::command
