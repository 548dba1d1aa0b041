#include "experiments/app/main.h"

#include <mujoco/mujoco.h>
#include <poll.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <new>
#include <opencv2/core/version.hpp>
#include <sstream>
#include <string>

#include "experiments/batch/result_store.h"
#include "experiments/command/command_line.h"
#include "experiments/command/progress.h"
#include "experiments/config/data_files.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/system/build_info.h"
#include "experiments/system/plain_text.h"
#include "sim/base/check.h"
#include "sim/view/gl_context.h"

// The commands in the order of the help: a module and its function that adds them to the line.
#define TURBIDOCK_COMMANDS(X)       \
  X(bench, AddBench)                \
  X(run, AddRun)                    \
  X(live, AddView)                  \
  X(app, AddBatch)                  \
  X(app, AddResults)                \
  X(app, AddReport)                 \
  X(gate, AddGate)                  \
  X(compare, AddCompare)            \
  X(estimate, AddEstimate)          \
  X(dataset, AddDataset)            \
  X(recognition, AddRecognize)      \
  X(recognition, AddCalibrate)      \
  X(tuning, AddTune)                \
  X(check_vehicle, AddCheckVehicle) \
  X(step_response, AddStepResponse) \
  X(app, AddList)

#define TURBIDOCK_DECLARE(module, Add)  \
  namespace turbidock::module {         \
  void Add(command::CommandLine& line); \
  }
TURBIDOCK_COMMANDS(TURBIDOCK_DECLARE)

namespace turbidock::app {
namespace {

// What this program was built from, runs on, and where its data is; or why that cannot be said.
void PrintVersions() {
  const auto said = [](const auto& what) -> std::string {
    try {
      return what();
    } catch (const std::exception& error) {
      return error.what();
    }
  };
  const std::string mesa =
      said([] { return view::MakeGlContext(view::GlBackend::kOsmesa)->description(); });
  std::printf("%sMuJoCo %s\nMesa %s\nOpenCV %s\ndata %s\n", system::BuiltFrom().c_str(),
              mj_versionString(), mesa.c_str(), CV_VERSION, said(config::DataDir).c_str());
}

int ParseAndRun(int argc, char** argv, const trial::Plugins& plugins) {
  command::CommandLine line(
      "turbidock", "Headless closed-loop docking trials of a stereo-vision ROV in turbid water.",
      plugins);
  line.Program().Footer(
      "Exit codes: 0 done, 1 a check failed, 2 bad usage or input, 3 inconclusive (gate), 4 this\n"
      "machine or a plug-in failed, 5 results differ that should not, 130/143 stopped by a\n"
      "signal, 141 nobody reads the output. Results go to stdout, everything else to stderr.");
  bool version = false;
  line.Program().Flag("--version", version, "Versions of the program and of what it runs on");
#define TURBIDOCK_ADD(module, Add) module::Add(line);
  TURBIDOCK_COMMANDS(TURBIDOCK_ADD)
  if (const std::optional<int> code = line.Parse(argc, argv)) return *code;
  if (version) {
    PrintVersions();
    return command::kExitDone;
  }
  std::signal(SIGINT, SIG_DFL);  // also where a shell's script started it with &
  // A file at its size limit or a pipe that nobody reads is an error of write, not the end.
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
  const std::optional<int> code = line.Run();
  if (code) return *code;
  std::fputs(line.Help().c_str(), stderr);
  return command::kExitBadInput;
}

// Whether the standard output is a pipe whose reader has left, as `head` does.
bool ReaderLeft() {
  pollfd out{.fd = STDOUT_FILENO, .events = 0, .revents = 0};
  return poll(&out, 1, 0) == 1 && (out.revents & POLLERR) != 0;
}

}  // namespace
}  // namespace turbidock::app

int turbidock::Main(int argc, char** argv, const trial::Plugins& plugins) {
  using namespace app;
  trial::Plugins all = plugins;
  all.SetProgram(std::filesystem::path(argv[0]).filename().string());
  // What is wrong, in one line, and the exit code.
  const auto complain = [&all](const std::string& problem, int code) {
    std::fprintf(stderr, "%s: %s\n", all.program().c_str(), system::OneLineOf(problem).c_str());
    return code;
  };
  const auto no_output = [&complain] {
    return ReaderLeft() ? 128 + SIGPIPE
                        : complain("the standard output cannot be written", command::kExitBadInput);
  };
  std::setvbuf(stdout, nullptr, _IOLBF, BUFSIZ);  // what stderr says comes after, also in a file
  try {
    const int code = ParseAndRun(argc, argv, all);
    if (std::fflush(stdout) != 0 || std::ferror(stdout)) return no_output();
    return command::StopSignal() ? 128 + command::StopSignal() : code;
  } catch (const config::ConfigErrors& errors) {
    std::istringstream lines(errors.what());
    for (std::string line; std::getline(lines, line);) complain(line, command::kExitBadInput);
    return command::kExitBadInput;
  } catch (const ConfigError& error) {
    return complain(error.what(), command::kExitBadInput);
  } catch (const batch::MismatchError& error) {
    return complain(error.what(), command::kExitMismatch);
  } catch (const std::filesystem::filesystem_error& error) {
    // a name that is too long, a loop of links, a folder that may not be read
    return complain(error.path1().string() + ": " + error.code().message(), command::kExitBadInput);
  } catch (const std::bad_alloc&) {
    return complain("this machine has too little memory for it", command::kExitSimulatorFault);
  } catch (const std::exception& error) {  // SimulatorFault
    // fmt::print throws what others only note
    if (std::ferror(stdout)) return no_output();
    return complain(error.what(), command::kExitSimulatorFault);
  }
}
