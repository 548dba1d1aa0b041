#pragma once
// Whole files, and early and equal words for the commonest mistakes: one that cannot be read or
// written, and one that would be overwritten by what is made of it.

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace turbidock::system {

// Makes a folder and those around it. ConfigError ("PATH: cannot be made: REASON").
void MakeFolder(const std::string& folder);
// The folder that a file stands in, likewise.
void MakeFolderOf(const std::string& path);

// A kind of file that the program writes, told by a text among its first bytes.
struct FileKind {
  std::string_view name, mark;
  std::string_view ending = {};  // of its files' names; empty: any
};
inline constexpr FileKind kResultFile = {"result file", "SQLite format 3"};
// Asked for by its name, whatever stands there: anything but results is replaced by it.
inline constexpr FileKind kAnyFile = {};

// ConfigError when no file of this kind is called so, or one stands at `path` that it does not
// replace: it replaces only its own kind, and what is empty.
void RequireReplaceable(const std::string& path, const FileKind& kind);

// Throws ConfigError ("PATH: cannot be written: REASON") when no file can be written at `path`,
// when what is there is no file, or is not to be replaced. Leaves the file system as it was.
void RequireWritable(const std::string& path, const FileKind& kind = kAnyFile);

// Every file that a command reads and writes, to be looked at together before any of them is opened
// for writing and before any work.
class OutputPlan {
 public:
  OutputPlan& Reads(const std::string& path);  // nothing if empty
  OutputPlan& Reads(const std::vector<std::string>& paths);
  // Nothing if empty. What is not asked for by its name has a kind. Whoever writes a file makes its
  // folder when needed.
  OutputPlan& Writes(const std::string& path, const FileKind& kind = kAnyFile);
  OutputPlan& WritesInto(const std::string& folder, const std::vector<std::string>& names);
  // ConfigError for an output that cannot be written, is an input (under whatever name), is written
  // twice, or would replace what it must not. Leaves the file system as it was.
  void Require() const;
  // Removes what stands at its outputs but results, which a run resumes: what an earlier run
  // said must not stand beside the trials of one that may not come to its end.
  void RemoveOld() const;

 private:
  struct Output {
    std::string path;
    FileKind kind;
  };

  std::vector<std::string> inputs_, folders_;
  std::vector<Output> outputs_;
};

// A file that is there complete or not at all: what writes it does so at partial(), and Commit
// gives it its name. Without that it is gone with this object, and what stood there stays.
class WholeFile {
 public:
  explicit WholeFile(const std::string& path);  // MakeFolderOf, RequireWritable
  ~WholeFile();
  WholeFile(const WholeFile&) = delete;
  WholeFile& operator=(const WholeFile&) = delete;

  const std::string& path() const { return path_; }  // for messages
  const std::string& partial() const { return partial_; }
  void Commit();  // ConfigError when it cannot

 private:
  std::string path_, target_, partial_;
};

// Writes such a file: a reader never sees half of it. ConfigError when it cannot be written.
void WriteWhole(const std::filesystem::path& path, const std::string& text);

// Every byte of a file. ConfigError "PATH: cannot be read: REASON", also for what is no regular
// file or has more than `most` bytes.
std::string ReadWhole(const std::filesystem::path& path, size_t most = size_t{256} << 20);

// Why no file can be read at `path`: it is not there, is a directory, a pipe; empty if one can.
std::string WhyUnreadable(const std::string& path);

}  // namespace turbidock::system
