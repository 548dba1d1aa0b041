#include "experiments/system/output_path.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <boost/scope_exit.hpp>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <functional>
#include <map>
#include <set>
#include <system_error>

#include "sim/base/check.h"

namespace turbidock::system {
namespace {

namespace fs = std::filesystem;

// What stands at a path, if anything: empty for a regular file.
std::string KindOf(const struct stat& found) {
  if (S_ISREG(found.st_mode)) return "";
  if (S_ISDIR(found.st_mode)) return "is a directory";
  return "is no regular file";
}

// The same text for all names of a file.
std::string IdentityOf(const std::string& path) {
  struct stat found {};
  if (stat(path.c_str(), &found) == 0)
    return std::to_string(found.st_dev) + ":" + std::to_string(found.st_ino);
  std::error_code error;
  const fs::path real = fs::weakly_canonical(path, error);
  return error ? path : real.string();
}

// Where a file of this name is written: behind a symbolic link, which stays.
std::string TargetOf(const std::string& path) {
  std::error_code error;
  if (!fs::is_symlink(path, error)) return path;
  const fs::path target = fs::weakly_canonical(path, error);
  return error ? path : target.string();
}

// The first bytes of a file; none of what is no file or cannot be read.
std::string BeginningOf(const std::string& path) {
  if (!WhyUnreadable(path).empty()) return "";  // opening a pipe would wait
  std::ifstream file(path, std::ios::binary);
  std::string begin(4096, '\0');
  file.read(begin.data(), std::ssize(begin));
  begin.resize(static_cast<size_t>(file.gcount()));
  return begin;
}

// Folders that are not there yet, with those around them: what is inside comes first.
std::set<fs::path, std::greater<>> MissingOf(const std::vector<std::string>& folders) {
  std::set<fs::path, std::greater<>> missing;
  std::error_code error;
  for (const std::string& folder : folders)
    for (fs::path path = fs::absolute(folder); !fs::exists(path, error) && !error;
         path = path.parent_path())
      missing.insert(path);
  return missing;
}

[[noreturn]] void FailWriting(const std::string& path, const std::string& why) {
  throw ConfigError(path, "cannot be written: " + why);
}

}  // namespace

void MakeFolder(const std::string& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (!error && !fs::is_directory(folder, error) && !error)
    error = std::make_error_code(std::errc::not_a_directory);
  if (error) throw ConfigError(folder, "cannot be made: " + error.message());
}

void MakeFolderOf(const std::string& path) {
  const fs::path folder = fs::path(path).parent_path();
  if (!folder.empty()) MakeFolder(folder.string());
}

void RequireReplaceable(const std::string& path, const FileKind& kind) {
  const std::string there = BeginningOf(path);
  const std::string remedy = "; name another file, or move this one away";
  if (kind.mark.empty() && there.starts_with(kResultFile.mark))
    throw ConfigError(path, "is a result file and is not replaced by another kind" + remedy);
  if (!there.empty() && there.find(kind.mark) == std::string::npos)
    throw ConfigError(path,
                      "is no " + std::string(kind.name) + " and is not replaced by one" + remedy);
  if (!path.ends_with(kind.ending))
    throw ConfigError(path, "will be a " + std::string(kind.name) + ": its name must end in " +
                                std::string(kind.ending));
}

void RequireWritable(const std::string& path, const FileKind& kind) {
  const auto fail = [&path] { FailWriting(path, std::strerror(errno)); };
  if (path.empty()) FailWriting("an empty name", std::strerror(ENOENT));
  struct stat found {};
  const bool exists = stat(path.c_str(), &found) == 0;
  if (!exists && errno != ENOENT) fail();
  if (exists && !KindOf(found).empty()) FailWriting(path, "it " + KindOf(found));
  if (exists && access(path.c_str(), W_OK) != 0) fail();
  RequireReplaceable(path, kind);
  // Where it will be written first.
  const std::string partial = TargetOf(path) + ".partial";
  const bool existed = access(partial.c_str(), F_OK) == 0;
  const int fd = open(partial.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NONBLOCK, 0666);
  if (fd < 0) fail();
  close(fd);
  if (!existed) unlink(partial.c_str());
}

OutputPlan& OutputPlan::Reads(const std::string& path) {
  if (!path.empty()) inputs_.push_back(path);
  return *this;
}

OutputPlan& OutputPlan::Reads(const std::vector<std::string>& paths) {
  for (const std::string& path : paths) Reads(path);
  return *this;
}

OutputPlan& OutputPlan::Writes(const std::string& path, const FileKind& kind) {
  if (path.empty()) return *this;
  outputs_.push_back({path, kind});
  const fs::path folder = fs::path(path).parent_path();
  if (!folder.empty()) folders_.push_back(folder.string());
  return *this;
}

OutputPlan& OutputPlan::WritesInto(const std::string& folder,
                                   const std::vector<std::string>& names) {
  folders_.push_back(folder);
  for (const std::string& name : names) Writes((fs::path(folder) / name).string());
  return *this;
}

void OutputPlan::Require() const {
  std::map<std::string, std::string> taken;  // by identity: what it is taken by
  for (const std::string& input : inputs_)
    if (access(input.c_str(), F_OK) == 0)  // else it is the name of something bundled
      taken[IdentityOf(input)] = "is read by this command";
  for (const auto& [path, kind] : outputs_) {
    const auto [by, is_free] = taken.emplace(IdentityOf(path), "is written by it twice");
    if (!is_free) throw ConfigError(path, by->second + "; give another file to write");
  }
  for (const auto& [path, kind] : outputs_) RequireReplaceable(path, kind);  // with no folder made
  const auto missing = MissingOf(folders_);
  BOOST_SCOPE_EXIT_ALL(&) {
    std::error_code ignored;
    for (const fs::path& folder : missing) fs::remove(folder, ignored);
  };
  for (const std::string& folder : folders_) MakeFolder(folder);
  for (const auto& [path, kind] : outputs_) RequireWritable(path, kind);
}

void OutputPlan::RemoveOld() const {
  for (const auto& [path, kind] : outputs_)
    if (kind.mark != kResultFile.mark) fs::remove(path);
}

WholeFile::WholeFile(const std::string& path)
    : path_(path), target_(TargetOf(path)), partial_(target_ + ".partial") {
  MakeFolderOf(path);
  RequireWritable(path);
}

WholeFile::~WholeFile() {
  if (!partial_.empty()) unlink(partial_.c_str());
}

void WholeFile::Commit() {
  if (std::rename(partial_.c_str(), target_.c_str()) != 0) FailWriting(path_, std::strerror(errno));
  partial_.clear();
}

void WriteWhole(const fs::path& path, const std::string& text) {
  WholeFile whole(path.string());
  {
    errno = 0;
    std::ofstream file(whole.partial(), std::ios::binary);
    file << text;
    file.close();
    if (!file) FailWriting(path.string(), std::strerror(errno));
  }
  whole.Commit();
}

std::string WhyUnreadable(const std::string& path) {
  struct stat found {};
  if (stat(path.c_str(), &found) != 0)
    return errno == ENOENT ? "no such file" : std::strerror(errno);
  return KindOf(found);
}

std::string ReadWhole(const fs::path& path, size_t most) {
  const auto fail = [&](const std::string& why) {
    throw ConfigError(path.string() + ": cannot be read: " + why);
  };
  struct stat found {};
  if (stat(path.c_str(), &found) != 0) fail(std::strerror(errno));
  if (const std::string kind = KindOf(found); !kind.empty()) fail("it " + kind);
  std::ifstream file(path, std::ios::binary);
  if (!file) fail(std::strerror(errno));
  std::string text;
  char buffer[1 << 16];
  while (file.read(buffer, sizeof buffer), file.gcount() > 0) {
    text.append(buffer, static_cast<size_t>(file.gcount()));
    if (text.size() > most) fail("it is larger than " + std::to_string(most >> 20U) + " MiB");
  }
  if (file.bad()) fail(std::strerror(errno));
  return text;
}

}  // namespace turbidock::system
