#include "experiments/media/image_source.h"

#include <fmt/format.h>
#include <glob.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string_view>

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
  constexpr std::array kStills = {".png", ".jpg", ".jpeg", ".jpe", ".jp2",  ".bmp", ".ppm",
                                  ".pgm", ".pnm", ".pam",  ".tif", ".tiff", ".tga", ".webp"};
  return std::find(kStills.begin(), kStills.end(), ExtensionOf(path)) != kStills.end();
}

// A pipe would keep a reader waiting for ever.
void RequireReadable(const std::string& file) {
  if (const std::string why = system::WhyUnreadable(file); !why.empty())
    throw ConfigError(file + ": " + why);
}

// The middle one of the steps between numbers in their order; 0 where there are none.
double StepOf(const std::vector<double>& numbers) {
  std::vector<double> steps;
  for (size_t i = 1; i < numbers.size(); ++i) steps.push_back(numbers[i] - numbers[i - 1]);
  std::ranges::sort(steps);
  return steps.empty() ? 0 : steps[steps.size() / 2];
}

// Some readers turn an image as its EXIF asks for, others do not.
void RequireUpright(const std::string& file, const std::string& bytes) {
  using namespace std::string_view_literals;
  const size_t exif = std::min(bytes.find("eXIf"), bytes.find("Exif"));
  if (exif == std::string::npos) return;
  for (const std::string_view tag : {"\x12\1\3\0\1\0\0\0"sv, "\1\x12\0\3\0\0\0\1\0"sv}) {
    const size_t at = bytes.find(tag, exif), value = at + tag.size();
    if (at < exif + 4096 && value < bytes.size() && bytes[value] >= 2 && bytes[value] <= 8)
      throw ConfigError(
          fmt::format("{}: is stored turned (EXIF orientation {}), which not every "
                      "program heeds; turn its pixels (mogrify -auto-orient)",
                      file, int{bytes[value]}));
  }
}

// A JPEG without its end decodes, grey where it is missing.
void RequireEnd(const std::string& file, const std::string& bytes) {
  // of the picture itself: a small one before it has an end of its own
  const size_t scan = bytes.rfind("\xff\xda");
  if (bytes.starts_with("\xff\xd8") && scan != std::string::npos &&
      bytes.find("\xff\xd9", scan) == std::string::npos)
    throw ConfigError(file + ": is cut off: it lacks its end");
}

VideoTimes TimesOf(const std::string& file) {
  using Json = nlohmann::json;
  const std::string asked =
      "packet=pts_time,flags:stream=nb_frames:stream_side_data=rotation:"
      "format=duration,nb_streams";
  VideoTimes out;
  Json said;
  try {
    system::Subprocess ffprobe({"ffprobe", "-v", "error", "-select_streams", "v:0", "-of", "json",
                                "-show_entries", asked, "file:" + file},
                               "ffmpeg");
    said = Json::parse(ffprobe.Finish());
  } catch (const SimulatorFault&) {
    return out;  // ffmpeg will say why
  }
  for (const Json& data : said["streams"][0]["side_data_list"])  // none of sound
    if (const int turned_deg = data.value("rotation", 0); turned_deg != 0)
      throw ConfigError(
          fmt::format("{}: says that it is stored turned (by {} degrees), which not every program "
                      "heeds; take that out (ffmpeg -i IN -metadata:s:v rotate=0 -c copy OUT) "
                      "or turn its pixels (ffmpeg -i IN OUT)",
                      file, turned_deg));
  size_t shown = 0;
  for (const Json& packet : said["packets"]) {
    ++shown;
    if (packet.contains("pts_time") && packet.value("flags", "").find('D') == std::string::npos)
      out.times_s.push_back(std::stod(packet["pts_time"].get<std::string>()));
  }
  std::ranges::sort(out.times_s);
  const auto number = [](const Json& of, const char* key) {
    return of.contains(key) ? std::atof(of[key].get<std::string>().c_str()) : 0;
  };
  const double promised = number(said["streams"][0], "nb_frames"),
               length_s = number(said["format"], "duration");
  if (promised > static_cast<double>(shown))
    out.cut_off = fmt::format("{} is cut off: it has {} of {} images", file, shown, promised);
  else if (promised == 0 && out.times_s.size() > 1 && said["format"]["nb_streams"] == 1 &&
           length_s > out.times_s.back() + 2.5 * StepOf(out.times_s))
    out.cut_off = fmt::format("{} is cut off: it ends at {:.2f} of {:.2f} s", file,
                              out.times_s.back(), length_s);
  return out;
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
            "ffmpeg", system::Subprocess::Output::kStream) {
    if (!IsStill(file)) said_ = TimesOf(file);
  }

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
      const std::string why = file_ + ": cannot be read: " + fault.what();
      if (count_ == 0) throw ConfigError(why);
      said_.cut_off = why;
    }
    if (count_ == 0) throw ConfigError(file_ + ": holds no images");
    return false;
  }
  bool is_still() const override { return IsStill(file_); }
  VideoTimes times() const override { return said_; }

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
  VideoTimes said_;
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
    const std::string bytes = system::ReadWhole(file);
    RequireUpright(file, bytes);
    RequireEnd(file, bytes);
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
std::pair<double, std::string> MomentOf(const std::string& file) {
  const std::string name = fs::path(file).filename().string(), digits = "0123456789";
  const size_t last = name.find_last_of(digits);
  if (last == std::string::npos) return {0, name};
  const size_t before = name.find_last_not_of(digits, last);  // npos + 1 is 0
  return {std::stod(name.substr(before + 1, last - before)), ""};
}

std::vector<double> NumbersOf(const std::vector<std::string>& files) {
  std::vector<double> numbers;
  numbers.reserve(files.size());
  for (const std::string& file : files) numbers.push_back(MomentOf(file).first);
  return numbers;
}

// The first place where files that are numbered in equal steps lack some; empty if there is none.
std::string GapIn(const std::vector<std::string>& files) {
  const std::vector<double> numbers = NumbersOf(files);
  const double step = StepOf(numbers);
  std::string gap;
  for (size_t i = 1; i < files.size(); ++i) {
    const double steps = (numbers[i] - numbers[i - 1]) / step;
    if (!(steps >= 1) || steps != std::floor(steps)) return "";
    if (steps > 1 && gap.empty())
      gap = fmt::format("{} follows {}: what was between them is missing.", files[i], files[i - 1]);
  }
  return gap;
}

// Whether files are paired by the numbers, or names, that they have in common.
bool RequirePairs(const Stereo<std::vector<std::string>>& files) {
  const auto& [left_files, right_files] = files;
  const size_t pairs = std::min(left_files.size(), right_files.size());
  for (size_t i = 0; i < pairs; ++i)
    if (std::error_code ignored; fs::equivalent(left_files[i], right_files[i], ignored))
      throw ConfigError(left_files[i] + ": is given for both sides");
  const double step = std::min(StepOf(NumbersOf(left_files)), StepOf(NumbersOf(right_files)));
  const auto are_near = [&](const auto& a, const auto& b) {
    return a.second == b.second && std::abs(a.first - b.first) <= std::max(0., 0.5 * step);
  };
  if (std::ranges::find_first_of(left_files, right_files, are_near, MomentOf, MomentOf) ==
      left_files.end())
    return false;
  for (size_t i = 0; i < pairs; ++i)
    if (!are_near(MomentOf(left_files[i]), MomentOf(right_files[i])))
      throw ConfigError(fmt::format("{} and {} are no pair: the file beside one of them is missing",
                                    left_files[i], right_files[i]));
  return true;
}

}  // namespace

std::vector<std::string> FilesOf(const std::string& name) {
  std::vector<std::string> files;
  if (fs::is_directory(name)) {
    for (const auto& entry : fs::directory_iterator(name))
      if (IsStill(entry.path()) && !entry.path().filename().string().starts_with('.'))
        files.push_back(entry.path().string());
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

std::unique_ptr<ImageSource> OpenImages(const std::string& name) {
  std::vector<std::string> files = FilesOf(name);
  if (files.empty() && fs::is_directory(name))
    throw ConfigError(name + ": this folder has no images");
  if (files.empty())
    throw ConfigError(name + ": there is no such file or folder, and no such images" +
                      (name.find('%') == std::string::npos ? "" : "; write * for the numbers"));
  const bool is_one = files[0] == name;
  if (!is_one || IsStill(name)) return std::make_unique<ImageFiles>(std::move(files), is_one);
  RequireReadable(name);
  return std::make_unique<DecodedImages>(name);
}

std::vector<std::string> ImagePairs::notes() const {
  std::vector<std::string> notes = notes_;
  std::vector<double> apart = apart_;
  std::ranges::sort(apart);
  constexpr double kTogether = 0.02;  // of a step: cameras that are triggered together
  if (!apart.empty() && apart[apart.size() / 2] > kTogether * step_)
    notes.push_back(fmt::format(
        "Left and right images are {:.3g} apart by {} (median; {:.3g} at most), where steps are "
        "{:.3g}: what moves aside by dy meanwhile seems x dy / baseline nearer or farther.",
        apart[apart.size() / 2],
        times_s_.left.empty() ? "the numbers in their names" : "the films' times in seconds",
        apart.back(), step_));
  return notes;
}

ImagePairs::ImagePairs(const Stereo<std::string>& names) : names_(names) {
  for (const Side side : kSides) {
    sources_[side] = OpenImages(names[side]);
    times_s_[side] = sources_[side]->times().times_s;
  }
  if (sources_.left->is_still() != sources_.right->is_still())
    throw ConfigError(fmt::format("{} and {}: one is a still image and the other is not",
                                  names.left, names.right));
  const Stereo<std::vector<std::string>> files = names.Each(FilesOf);
  if (RequirePairs(files))
    for (size_t i = 0; i < std::min(files.left.size(), files.right.size()); ++i)
      apart_.push_back(std::abs(MomentOf(files.left[i]).first - MomentOf(files.right[i]).first));
  step_ = std::min(StepOf(NumbersOf(files.left)), StepOf(NumbersOf(files.right)));
  if (const std::string gap = GapIn(files.left); !gap.empty()) notes_.push_back(gap);
  const auto& [left, right] = times_s_;
  if (!left.empty()) step_ = std::min(StepOf(left), StepOf(right));
  tolerance_s_ = left.empty() ? 0 : 0.5 * step_;
  const bool are_apart =
      tolerance_s_ > 0 && (left.back() < right.front() || right.back() < left.front());
  if (are_apart)
    notes_.push_back("The videos have no time in common: their images are paired in their order.");
  if (are_apart || tolerance_s_ <= 0) times_s_ = {};
}

bool ImagePairs::Next(StereoImage* pair) {
  const auto has_next = [&](Side side) {
    const bool has = sources_[side]->Next(&(*pair)[side]);
    seen_[side] += has;
    return has;
  };
  const auto time_s = [&](Side side) {  // none once a video has more images than times
    const size_t count = seen_[side];
    return count <= times_s_[side].size() ? times_s_[side][count - 1] : NAN;
  };
  Stereo<bool> has{has_next(Side::kLeft), has_next(Side::kRight)};
  while (has.left && has.right) {
    const double left_s = time_s(Side::kLeft), right_s = time_s(Side::kRight);
    if (!(std::abs(left_s - right_s) > tolerance_s_)) {
      if (std::isfinite(left_s - right_s)) apart_.push_back(std::abs(left_s - right_s));
      return true;
    }
    const Side early = left_s < right_s ? Side::kLeft : Side::kRight;
    if (!std::exchange(has_left_out_[early], true))
      notes_.push_back(
          fmt::format("{}: the image at {:.3f} s is left out, and others like it; the other side "
                      "has none of that time.",
                      names_[early], std::min(left_s, right_s)));
    has[early] = has_next(early);
  }
  for (const Side side : kSides)
    if (incomplete_.empty()) incomplete_ = sources_[side]->times().cut_off;
  const Side ended = has.left ? Side::kRight : Side::kLeft,
             other = has.left ? Side::kLeft : Side::kRight;
  if (incomplete_.empty() && (has.left || has.right))
    incomplete_ = fmt::format("{} ends after {} frames, {} goes on", names_[ended], seen_[ended],
                              names_[other]);
  return false;
}

}  // namespace turbidock::media
