#include "experiments/system/output_path.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <memory>
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
  const auto fail = [&] {
    return ConfigError(path.string() + ": cannot be read: " + std::strerror(errno));
  };
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"),
                                                             &std::fclose);
  if (!file) throw fail();
  std::string text;
  char buffer[4096];
  while (const size_t n = std::fread(buffer, 1, sizeof buffer, file.get())) text.append(buffer, n);
  if (std::ferror(file.get())) throw fail();
  return text;
}

}  // namespace turbidock::system
