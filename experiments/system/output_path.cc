#include "experiments/system/output_path.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <system_error>

#include "sim/base/check.h"

namespace turbidock::system {

void RequireWritable(const std::string& path) {
  const bool existed = access(path.c_str(), F_OK) == 0;
  const int fd = open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0666);
  if (fd < 0) throw ConfigError(path, std::string("cannot be written: ") + std::strerror(errno));
  close(fd);
  if (!existed) unlink(path.c_str());
}

void WriteWhole(const std::filesystem::path& path, const std::string& text) {
  const std::filesystem::path partial = path.string() + ".partial";
  {
    std::ofstream file(partial, std::ios::binary);
    file << text;
    file.flush();
    if (!file) throw ConfigError(path.string() + ": cannot be written: " + std::strerror(errno));
  }
  std::error_code error;
  std::filesystem::rename(partial, path, error);
  if (error) {
    std::filesystem::remove(partial);
    throw ConfigError(path.string() + ": cannot be written: " + error.message());
  }
}

std::string ReadWhole(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string text(std::istreambuf_iterator<char>(file), {});
  if (!file) throw ConfigError(path.string() + ": cannot be read");
  return text;
}

}  // namespace turbidock::system
