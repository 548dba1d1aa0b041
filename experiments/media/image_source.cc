#include "experiments/media/image_source.h"

#include <fmt/format.h>
#include <glob.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <vector>

#include "experiments/media/mp4_writer.h"
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
        ffmpeg_(
            FfmpegCommand(fmt::format("-max_pixels {} -i FILE -map 0:v:0 -f image2pipe -c:v ppm "
                                      "-pix_fmt rgb24 -fps_mode passthrough pipe:1",
                                      int64_t{kLargestImage_px} * kLargestImage_px),
                          file),
            "ffmpeg", system::Subprocess::Output::kStream) {}

  bool Next(Image3u8* image) override {
    if (at_end_) return false;
    int64_t width_px = 0, height_px = 0;
    if (ReadHeader(&width_px, &height_px)) {
      RequireImageSize(width_px, height_px, file_);
      image->Resize(static_cast<int>(width_px), static_cast<int>(height_px));
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
  // Of the next image: "P6", width, height and largest value, each followed by one white space.
  bool ReadHeader(int64_t* width_px, int64_t* height_px) {
    std::array<std::string, 4> words;
    for (std::string& word : words)
      for (char c = 0; ffmpeg_.Read(&c, 1) == 1 && !std::isspace(static_cast<unsigned char>(c));)
        word += c;
    if (words[0].empty()) return false;
    if (words[0] != "P6") throw SimulatorFault(file_ + ": ffmpeg's output is not understood");
    *width_px = std::atoll(words[1].c_str());
    *height_px = std::atoll(words[2].c_str());
    return true;
  }

  std::string file_;
  system::Subprocess ffmpeg_;
  int64_t count_ = 0;
  bool at_end_ = false;
};

class ImageFiles : public ImageSource {
 public:
  ImageFiles(std::vector<std::string> files, bool still)
      : files_(std::move(files)), still_(still) {}

  bool Next(Image3u8* image) override {
    if (next_ == files_.size()) return false;
    const std::string& file = files_[next_++];
    RequireReadable(file);
    if (ExtensionOf(file) == ".png")
      *image = ReadPng(file);
    else
      DecodedImages(file).Next(image);
    return true;
  }
  bool is_still() const override { return still_; }

 private:
  std::vector<std::string> files_;
  bool still_;
  size_t next_ = 0;
};

// What tells a file from others of its side: the last number in its name, or else the name.
std::string MomentOf(const std::string& file) {
  const std::string name = fs::path(file).filename().string(), digits = "0123456789";
  const size_t last = name.find_last_of(digits);
  if (last == std::string::npos) return name;
  const size_t before = name.find_last_not_of(digits, last);  // npos + 1 is 0
  return name.substr(before + 1, last - before);
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
    glob_t found{};
    if (glob(name.c_str(), 0, nullptr, &found) == 0)
      files.assign(found.gl_pathv, found.gl_pathv + found.gl_pathc);
    globfree(&found);
  }
  // 2 before 10, whether or not numbers are written with zeros before them
  std::ranges::sort(files, [](const std::string& a, const std::string& b) {
    return strverscmp(a.c_str(), b.c_str()) < 0;
  });
  return files;
}

void RequirePairs(const std::string& left, const std::string& right) {
  const std::vector<std::string> left_files = FilesOf(left), right_files = FilesOf(right);
  const size_t pairs = std::min(left_files.size(), right_files.size());
  for (size_t i = 0; i < pairs; ++i)
    if (std::error_code ignored; fs::equivalent(left_files[i], right_files[i], ignored))
      throw ConfigError(left_files[i] + ": is given for both sides");
  if (std::ranges::find_first_of(left_files, right_files, {}, MomentOf, MomentOf) ==
      left_files.end())
    return;
  for (size_t i = 0; i < pairs; ++i)
    if (MomentOf(left_files[i]) != MomentOf(right_files[i]))
      throw ConfigError(fmt::format("{} and {} are no pair: the file beside one of them is missing",
                                    left_files[i], right_files[i]));
}

std::unique_ptr<ImageSource> OpenImages(const std::string& name) {
  std::vector<std::string> files = FilesOf(name);
  if (files.empty())
    throw ConfigError(name + ": there is no such file or folder, and no such images" +
                      (name.find('%') == std::string::npos ? "" : "; write * for the numbers"));
  const bool is_one = files[0] == name;
  if (!is_one || IsStill(name)) return std::make_unique<ImageFiles>(std::move(files), is_one);
  RequireReadable(name);
  return std::make_unique<DecodedImages>(name);
}

}  // namespace turbidock::media
