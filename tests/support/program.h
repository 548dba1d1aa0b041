#pragma once
// The program under test, as a user runs it.

#include <sys/types.h>

#include <string>
#include <vector>

namespace turbidock::testing {

// The executable beside the test's own.
std::string ProgramPath();

struct ProgramEnd {
  int exit_code = -1;  // 128 + signal when killed by one
  std::string out, err;
};

// Runs the program with these arguments to its end; `environment` ("NAME=VALUE") replaces or adds
// to the test's own.
ProgramEnd RunProgram(const std::vector<std::string>& arguments,
                      const std::vector<std::string>& environment = {});
// The same with a copy of the program at another path.
ProgramEnd RunProgramAt(const std::string& path, const std::vector<std::string>& arguments,
                        const std::vector<std::string>& environment = {});

// Starts the program and returns its process: the caller waits for it. It prints to nobody, or what
// goes to stderr into a file.
pid_t StartProgram(const std::vector<std::string>& arguments,
                   const std::string& errors = "/dev/null");

}  // namespace turbidock::testing
