#include "tests/support/program.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>

#include "sim/base/check.h"

namespace turbidock::testing {
namespace {

std::string ReadAndClose(int fd) {
  std::string text(static_cast<size_t>(lseek(fd, 0, SEEK_END)), '\0');
  TD_CHECK(pread(fd, text.data(), text.size(), 0) == static_cast<ssize_t>(text.size()),
           "a memory file reads back whole");
  close(fd);
  return text;
}

pid_t Spawn(const std::string& path, const std::vector<std::string>& arguments,
            const posix_spawn_file_actions_t& files, char* const* environment) {
  std::vector<std::string> words = {path};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  pid_t pid = -1;
  const int failure = posix_spawn(&pid, argv[0], &files, nullptr, argv.data(), environment);
  TD_CHECK(failure == 0, "cannot start " + path);
  return pid;
}

}  // namespace

std::string ProgramPath() {
  return (std::filesystem::read_symlink("/proc/self/exe").parent_path() / "turbidock").string();
}

ProgramEnd RunProgram(const std::vector<std::string>& arguments,
                      const std::vector<std::string>& environment) {
  return RunProgramAt(ProgramPath(), arguments, environment);
}

pid_t StartProgram(const std::vector<std::string>& arguments, const std::string& errors) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, errors.c_str(), O_WRONLY | O_CREAT,
                                   0666);
  const pid_t pid = Spawn(ProgramPath(), arguments, actions, environ);
  posix_spawn_file_actions_destroy(&actions);
  return pid;
}

ProgramEnd RunProgramAt(const std::string& path, const std::vector<std::string>& arguments,
                        const std::vector<std::string>& environment) {
  std::vector<std::string> variables = environment;
  for (char** entry = environ; *entry; ++entry) {
    const std::string name = std::string(*entry).substr(0, std::string(*entry).find('=') + 1);
    const bool replaced = std::any_of(environment.begin(), environment.end(),
                                      [&](const auto& given) { return given.starts_with(name); });
    if (!replaced) variables.emplace_back(*entry);
  }
  std::vector<char*> envp;
  for (std::string& variable : variables) envp.push_back(variable.data());
  envp.push_back(nullptr);

  const int out = memfd_create("out", MFD_CLOEXEC), err = memfd_create("err", MFD_CLOEXEC);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, out, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, err, STDERR_FILENO);
  const pid_t pid = Spawn(path, arguments, actions, envp.data());
  posix_spawn_file_actions_destroy(&actions);
  int status = 0;
  waitpid(pid, &status, 0);
  ProgramEnd end;
  end.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  end.out = ReadAndClose(out);
  end.err = ReadAndClose(err);
  return end;
}

}  // namespace turbidock::testing
