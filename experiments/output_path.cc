#include "experiments/output_path.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "sim/base/check.h"

namespace turbidock::experiments {

void RequireWritable(const std::string& path) {
  const bool existed = access(path.c_str(), F_OK) == 0;
  const int fd = open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0666);
  if (fd < 0) throw ConfigError(path, std::string("cannot be written: ") + std::strerror(errno));
  close(fd);
  if (!existed) unlink(path.c_str());
}

}  // namespace turbidock::experiments
