#include "experiments/media/image_source.h"

#include <fmt/format.h>
#include <glob.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <optional>
#include <vector>

#include "experiments/media/png.h"
#include "experiments/system/output_path.h"
#include "experiments/system/subprocess.h"
#include "sim/base/check.h"

namespace turbidock::media {
namespace {

namespace fs = std::filesystem;

constexpr const char* kWild = "*?[]";  // in a shell's pattern

std::string ExtensionOf(const fs::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

bool IsStill(const fs::path& path) {
  constexpr std::array kStills = {".png", ".jpg", ".jpeg", ".bmp",
                                  ".ppm", ".tif", ".tiff", ".webp"};
  return std::find(kStills.begin(), kStills.end(), ExtensionOf(path)) != kStills.end();
}

// A pipe would keep a reader waiting for ever.
void RequireReadable(const std::string& file) {
  if (const std::string why = system::WhyUnreadable(file); !why.empty())
    throw ConfigError(file + ": " + why);
}

// Whatever ffmpeg can decode, as a stream of PPM images: each says its own size.
class DecodedImages : public ImageSource {
 public:
  explicit DecodedImages(const std::string& file)
      : file_(file),
        ffmpeg_({"ffmpeg",
                 "-nostdin",
                 "-hide_banner",
                 "-loglevel",
                 "error",
                 "-max_pixels",
                 std::to_string(int64_t{kLargestImage_px} * kLargestImage_px),
                 "-i",
                 "file:" + file,
                 "-map",
                 "0:v:0",
                 "-f",
                 "image2pipe",
                 "-c:v",
                 "ppm",
                 "-pix_fmt",
                 "rgb24",
                 "-fps_mode",
                 "passthrough",
                 "pipe:1"},
                "ffmpeg", system::Subprocess::Output::kStream) {}

  bool Next(Image3u8* image) override {
    if (at_end_) return false;
    const std::optional<std::array<int64_t, 2>> size = ReadHeader();
    if (size) {
      RequireImageSize((*size)[0], (*size)[1], file_);
      image->Resize(static_cast<int>((*size)[0]), static_cast<int>((*size)[1]));
      const size_t bytes = 3 * image->pixels();
      if (ffmpeg_.Read(image->data(), bytes) == bytes) {
        ++count_;
        return true;
      }
    }
    at_end_ = true;
    try {
      ffmpeg_.Finish();
    } catch (const SimulatorFault& fault) {
      // What could be read before stays; a file of which nothing can be read is bad input.
      if (count_ == 0) throw ConfigError(file_ + ": cannot be read: " + fault.what());
    }
    if (count_ == 0) throw ConfigError(file_ + ": holds no images");
    return false;
  }
  bool is_still() const override { return IsStill(file_); }

 private:
  // "P6", width, height and largest value, each followed by one white space.
  std::optional<std::array<int64_t, 2>> ReadHeader() {
    std::array<std::string, 4> words;
    for (std::string& word : words)
      for (char c = 0; ffmpeg_.Read(&c, 1) == 1 && !std::isspace(static_cast<unsigned char>(c));)
        word += c;
    if (words[0].empty()) return std::nullopt;
    std::array<int64_t, 2> size{};
    const auto read = [](const std::string& word, int64_t* number) {
      const char* const end = word.data() + word.size();
      const auto [stop, error] = std::from_chars(word.data(), end, *number);
      return error == std::errc() && stop == end;
    };
    if (words[0] != "P6" || !read(words[1], &size[0]) || !read(words[2], &size[1]))
      throw SimulatorFault(file_ + ": ffmpeg's output is not understood");
    return size;
  }

  std::string file_;
  system::Subprocess ffmpeg_;
  int64_t count_ = 0;
  bool at_end_ = false;
};

Image3u8 ReadStill(const std::string& file) {
  RequireReadable(file);
  if (ExtensionOf(file) == ".png") return ReadPng(file);
  Image3u8 image;
  DecodedImages(file).Next(&image);
  return image;
}

class ImageFiles : public ImageSource {
 public:
  explicit ImageFiles(std::vector<std::string> files, bool still)
      : files_(std::move(files)), still_(still) {}

  bool Next(Image3u8* image) override {
    if (next_ == files_.size()) return false;
    *image = ReadStill(files_[next_++]);
    return true;
  }
  bool is_still() const override { return still_; }

 private:
  std::vector<std::string> files_;
  bool still_;
  size_t next_ = 0;
};

bool IsOneFile(const std::string& name, const std::vector<std::string>& files) {
  return files.size() == 1 && files[0] == name;
}

// What a pattern leaves open of its files' names, of a folder their names; none of a file itself.
std::vector<std::string> OpenPartsOf(const std::string& name,
                                     const std::vector<std::string>& files) {
  std::vector<std::string> parts;
  if (IsOneFile(name, files)) return parts;
  const bool is_folder = fs::is_directory(name);
  const size_t first = name.find_first_of(kWild);
  const size_t after = name.size() - name.find_last_of(kWild) - 1;
  for (const std::string& file : files)
    parts.push_back(is_folder ? fs::path(file).filename().string()
                              : file.substr(first, file.size() - first - after));
  return parts;
}

std::vector<std::string> FilesOfPattern(const std::string& pattern) {
  std::vector<std::string> files;
  glob_t found{};
  if (glob(pattern.c_str(), 0, nullptr, &found) == 0)
    files.assign(found.gl_pathv, found.gl_pathv + found.gl_pathc);
  globfree(&found);
  return files;
}

// 2 before 10, whether or not numbers are written with zeros before them.
void SortByName(std::vector<std::string>* files) {
  std::sort(files->begin(), files->end(), [](const std::string& a, const std::string& b) {
    return strverscmp(a.c_str(), b.c_str()) < 0;
  });
}

}  // namespace

std::vector<std::string> FilesOf(const std::string& name) {
  std::vector<std::string> files;
  if (fs::is_directory(name)) {
    for (const auto& entry : fs::directory_iterator(name))
      if (IsStill(entry.path())) files.push_back(entry.path().string());
  } else if (fs::exists(name)) {
    return {name};
  } else if (name.find_first_of(kWild) != std::string::npos) {
    files = FilesOfPattern(name);
  }
  SortByName(&files);
  return files;
}

void RequirePairs(const std::string& left, const std::string& right) {
  const std::vector<std::string> left_files = FilesOf(left), right_files = FilesOf(right);
  const size_t pairs = std::min(left_files.size(), right_files.size());
  for (size_t i = 0; i < pairs; ++i)
    if (std::error_code ignored; fs::equivalent(left_files[i], right_files[i], ignored))
      throw ConfigError(left_files[i] + ": is given for both sides");
  const std::vector<std::string> left_parts = OpenPartsOf(left, left_files),
                                 right_parts = OpenPartsOf(right, right_files);
  if (std::ranges::find_first_of(left_parts, right_parts) == left_parts.end()) return;
  for (size_t i = 0; i < pairs; ++i)
    if (left_parts[i] != right_parts[i])
      throw ConfigError(fmt::format("{} and {} are no pair: the file beside one of them is missing",
                                    left_files[i], right_files[i]));
}

std::unique_ptr<ImageSource> OpenImages(const std::string& name) {
  std::vector<std::string> files = FilesOf(name);
  if (files.empty())
    throw ConfigError(name + ": there is no such file or folder, and no such images" +
                      (name.find('%') == std::string::npos ? "" : "; write * for the numbers"));
  if (!IsOneFile(name, files)) return std::make_unique<ImageFiles>(std::move(files), false);
  if (IsStill(name)) return std::make_unique<ImageFiles>(std::move(files), true);
  RequireReadable(name);
  return std::make_unique<DecodedImages>(name);
}

}  // namespace turbidock::media
