// Which images and recordings are read, and what is said of the others: the table
// tests/data/variants/footage.txt is drawn from the variants below and compared with the committed
// one.

#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <regex>

#include "experiments/media/image_source.h"
#include "experiments/media/png.h"
#include "experiments/system/subprocess.h"
#include "sim/base/check.h"
#include "tests/support/drawn_table.h"

namespace turbidock::media {
namespace {

namespace fs = std::filesystem;

constexpr int kFrames = 12;

std::string Folder(const std::string& name = "") {
  const std::string folder = ::testing::TempDir() + "footage/" + name + (name.empty() ? "" : "/");
  fs::create_directories(folder);
  return folder;
}

void Ffmpeg(const std::string& arguments) {
  std::vector<std::string> command{"ffmpeg", "-v", "error", "-y"};
  std::istringstream words(arguments);
  for (std::string word; words >> word;) command.push_back(word);
  system::Subprocess(command, "ffmpeg").Finish();
}

// Puts a chunk behind the header of a PNG.
void AddChunk(const std::string& from, const std::string& to, const std::string& name_and_data) {
  std::ifstream stream(from, std::ios::binary);
  std::string png(std::istreambuf_iterator<char>(stream), {});
  const auto word = [](uint32_t value) {
    std::string bytes;
    for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(value >> shift & 0xff);
    return bytes;
  };
  uint32_t crc = 0xffffffff;
  for (const char c : name_and_data) {
    crc ^= static_cast<unsigned char>(c);
    for (int k = 0; k < 8; ++k) crc = crc >> 1 ^ (crc & 1 ? 0xedb88320 : 0);
  }
  png.insert(33,
             word(static_cast<uint32_t>(name_and_data.size() - 4)) + name_and_data + word(~crc));
  std::ofstream(to, std::ios::binary) << png;
}

std::string Named(std::string text) {
  for (size_t at; (at = text.find(Folder())) != std::string::npos;) text.erase(at, Folder().size());
  return text;
}

std::string Outcome(const std::function<std::string()>& of) {
  try {
    return of();
  } catch (const ConfigError& error) {
    return "refused: " + Named(error.what());
  }
}

std::string Row(const std::string& kind, const std::string& name,
                const std::function<std::string()>& of) {
  return "| " + kind + " | " + name + " | " + Outcome(of) + " |\n";
}

// A picture of smooth colours, in whatever format ffmpeg writes it.
std::vector<std::string> Stills() {
  Image3u8 picture(64, 48);
  for (int v = 0; v < 48; ++v)
    for (int u = 0; u < 64; ++u) {
      picture.at(u, v)[0] = static_cast<uint8_t>(3 * u);
      picture.at(u, v)[1] = static_cast<uint8_t>(5 * v);
      picture.at(u, v)[2] = static_cast<uint8_t>(255 - 2 * u - v);
    }
  const std::string folder = Folder("stills"), from = folder + "plain.png";
  WritePng(from, picture);
  const auto read = [&](const std::string& name) {
    Image3u8 image;
    OpenImages(folder + name)->Next(&image);
    int worst = 0, colour = 0;
    for (size_t i = 0; i < 3 * image.pixels(); ++i) {
      worst = std::max(worst, std::abs(image.data()[i] - picture.data()[i]));
      colour = std::max(colour, std::abs(image.data()[i] - image.data()[i - i % 3]));
    }
    if (colour == 0) return std::string("grey");
    return worst <= 1   ? std::string("as it is")
           : worst < 16 ? std::string("as it is, but for its compression")
                        : "other values: by up to " + std::to_string(worst);
  };
  const auto written = [&](const std::string& name, const std::string& options) {
    return [=] {
      Ffmpeg("-i " + from + " " + options + " " + folder + name);
      return read(name);
    };
  };
  const auto with_chunk = [&](const std::string& name, const std::string& chunk) {
    return [=] {
      AddChunk(folder + (name == "gamma16.png" ? "16.png" : "plain.png"), folder + name, chunk);
      return read(name);
    };
  };
  const std::string upright("II*\0\x08\0\0\0\1\0\x12\1\3\0\1\0\0\0\1\0\0\0\0\0\0\0", 26),
      turned("MM\0*\0\0\0\x08\0\1\1\x12\0\3\0\0\0\1\0\6\0\0\0\0\0\0", 26);
  return {Row("PNG", "8 bits", [&] { return read("plain.png"); }),
          Row("PNG", "16 bits", written("16.png", "-pix_fmt rgb48be")),
          Row("PNG", "8 bits, gAMA of linear light",
              with_chunk("gamma.png", std::string("gAMA\0\1\x86\xa0", 8))),
          Row("PNG", "16 bits, gAMA of linear light",
              with_chunk("gamma16.png", std::string("gAMA\0\1\x86\xa0", 8))),
          Row("PNG", "sRGB", with_chunk("srgb.png", std::string("sRGB\0", 5))),
          Row("PNG", "alpha", written("alpha.png", "-pix_fmt rgba")),
          Row("PNG", "alpha, half transparent",
              written("half.png", "-vf format=rgba,colorchannelmixer=aa=0.5")),
          Row("PNG", "alpha, transparent",
              written("none.png", "-vf format=rgba,colorchannelmixer=aa=0")),
          Row("PNG", "grey", written("grey.png", "-pix_fmt gray")),
          Row("PNG", "grey, 16 bits", written("grey16.png", "-pix_fmt gray16be")),
          Row("PNG", "EXIF, upright", with_chunk("upright.png", "eXIf" + upright)),
          Row("PNG", "EXIF, turned", with_chunk("turned.png", "eXIf" + turned)),
          Row("TIFF", "8 bits", written("8.tif", "-pix_fmt rgb24")),
          Row("TIFF", "16 bits", written("16.tiff", "-pix_fmt rgb48le")),
          Row("BMP", "8 bits", written("8.bmp", "-pix_fmt bgr24")),
          Row("TGA", "8 bits", written("8.tga", "-pix_fmt bgr24")),
          Row("PPM", "16 bits", written("16.ppm", "-pix_fmt rgb48be")),
          Row("PGM", "8 bits", written("8.pgm", "-pix_fmt gray")),
          Row("JPEG", "quality 2", written("2.jpg", "-q:v 2")),
          Row("JPEG", "cut off in the middle",
              [&] {
                fs::copy_file(folder + "2.jpg", folder + "cut.jpg");
                fs::resize_file(folder + "cut.jpg", fs::file_size(folder + "2.jpg") / 2);
                return read("cut.jpg");
              }),
          Row("any", "an empty file", [&] {
            std::ofstream(folder + "empty.png");
            return read("empty.png");
          })};
}

// Image k of a side is of one colour, which says what k is.
void WriteImages(const std::string& pattern, int side, const std::function<int(int)>& number) {
  for (int k = 0; k < kFrames; ++k) {
    std::array<char, 300> name{};
    if (number(k) < 0) continue;
    std::snprintf(name.data(), name.size(), pattern.c_str(), number(k));  // NOLINT
    WritePng(name.data(), Image3u8(16, 16, static_cast<uint8_t>(20 * k + 9 + side)));
  }
}

std::string PairsOf(const std::string& left, const std::string& right) {
  ImagePairs pairs({left, right});
  StereoImage pair;
  int count = 0, wrong = 0, before = -1;
  for (; pairs.Next(&pair); ++count) {
    const int k = *pair.left.data() / 20;
    wrong += *pair.right.data() / 20 != k || k <= before;
    before = k;
  }
  std::string text = std::to_string(count) + " pairs";
  if (wrong > 0) text += ", " + std::to_string(wrong) + " of them wrong";
  for (const std::string& note : pairs.notes()) text += "; " + note;
  return Named(text + (pairs.incomplete().empty() ? "" : "; incomplete: " + pairs.incomplete()));
}

std::vector<std::string> Sequences() {
  const auto files = [](const std::string& name, const std::function<int(int)>& left,
                        const std::function<int(int)>& right, const std::string& format = "%04d") {
    return [=] {
      WriteImages(Folder(name + "/left") + "f_" + format + ".png", 0, left);
      WriteImages(Folder(name + "/right") + "f_" + format + ".png", 1, right);
      return PairsOf(Folder(name + "/left"), Folder(name + "/right"));
    };
  };
  const auto plain = [](int k) { return k + 1; };
  const auto without = [](int missing) { return [=](int k) { return k == missing ? -1 : k + 1; }; };
  const auto stamp = [](int offset, int missing) {
    return [=](int k) { return k == missing ? -1 : 1000 + 33 * k + k % 2 + offset; };
  };
  return {Row("files", "numbers with zeros before them", files("pad", plain, plain)),
          Row("files", "numbers without", files("unpad", plain, plain, "%d")),
          Row("files", "from 100",
              files(
                  "from100", [](int k) { return k + 100; }, [](int k) { return k + 100; }, "%d")),
          Row("files", "every tenth",
              files(
                  "tenth", [](int k) { return 10 * k; }, [](int k) { return 10 * k; })),
          Row("files", "one missing on both sides", files("gap", without(5), without(5))),
          Row("files", "one missing on the right", files("missing", plain, without(5))),
          Row("files", "the last missing on the right", files("last", plain, without(kFrames - 1))),
          Row("files", "times, not quite equal", files("times", stamp(0, -1), stamp(3, -1))),
          Row("files", "times, one missing on the left",
              files("times_missing", stamp(0, 5), stamp(3, -1))),
          Row("files", "hidden files of macOS",
              [&] {
                const std::string folder = Folder("mac");
                WriteImages(folder + "f_%d.png", 0, plain);
                std::ofstream(folder + "._f_1.png") << "Mac OS X";
                return std::to_string(FilesOf(folder).size()) + " images";
              }),
          Row("files", "`left_%04d.png`",
              [&] { return PairsOf(Folder("pad/left") + "f_%04d.png", Folder("pad/right")); })};
}

std::vector<std::string> Videos() {
  const std::string folder = Folder("video");
  for (const auto& [side, name] : {std::pair(0, "l"), std::pair(1, "r")})
    WriteImages(folder + name + "_%d.png", side, [](int k) { return k; });
  const auto make = [&](const std::string& name, const std::string& options) {
    const std::string input = "-framerate 30 -i " + folder + name.substr(0, 1) + "_%d.png ";
    Ffmpeg(input + options + " " + folder + name);
    return folder + name;
  };
  const auto both = [&](const std::string& extension, const std::string& options,
                        double share = 1) {
    return [=] {
      Stereo<std::string> videos{make("l." + extension, options), make("r." + extension, options)};
      for (const Side side : kSides)
        if (share < 1)
          fs::resize_file(
              videos[side],
              static_cast<uintmax_t>(share * static_cast<double>(fs::file_size(videos[side]))));
      const std::string text = PairsOf(videos.left, videos.right);  // how far depends on ffmpeg
      return share < 1 ? std::regex_replace(text, std::regex("[0-9]+(\\.[0-9]+)?"), "N") : text;
    };
  };
  const auto right_with = [&](const std::string& options) {
    return [=] {
      return PairsOf(make("l.mkv", "-c:v ffv1"),
                     make("r.mkv", options + " -fps_mode passthrough -c:v ffv1"));
    };
  };
  return {
      Row("video", "Matroska", both("mkv", "-c:v ffv1")),
      Row("video", "AVI", both("avi", "-c:v ffv1")),
      Row("video", "MP4 with B-frames", both("mp4", "-c:v libx264 -qp 0")),
      Row("video", "MP4 that says it is turned",
          [=] {
            const std::string plain = make("l.mp4", "-c:v libx264 -qp 0");
            Ffmpeg("-i " + plain + " -c copy -metadata:s:v rotate=180 " + folder + "turned.mp4");
            return PairsOf(folder + "turned.mp4", plain);
          }),
      Row("video", "sound alone",
          [=] {
            Ffmpeg("-f lavfi -i sine=duration=1 " + folder + "sound.mp4");
            return PairsOf(folder + "sound.mp4", make("l.mp4", "-c:v libx264 -qp 0"));
          }),
      Row("video", "MPEG transport stream", both("ts", "-c:v libx264 -qp 0")),
      Row("video", "raw H.264, no times", both("h264", "-c:v libx264 -qp 0")),
      Row("video", "Matroska, cut off", both("mkv", "-c:v mjpeg -q:v 1", 0.6)),
      Row("video", "AVI, cut off", both("avi", "-c:v mjpeg -q:v 1", 0.9)),
      Row("video", "the sixth image of the right one is dropped",
          right_with("-vf select=not(eq(n\\,5))")),
      Row("video", "the right one begins three images later", right_with("-vf select=gte(n\\,3)")),
      Row("video", "the right one has half the rate", right_with("-vf select=not(mod(n\\,2))")),
      Row("video", "the right one is of another clock", right_with("-vf setpts=PTS+60/TB"))};
}

TEST(Footage, IsReadOrRefusedAsTheTableSays) {
  std::string table = "| Kind | Variant | Outcome |\n|---|---|---|\n";
  for (const std::vector<std::string>& rows : {Stills(), Sequences(), Videos()})
    for (const std::string& row : rows) table += row;
  testing::ExpectDrawn("footage.txt", table);
  fs::remove_all(Folder());
}

}  // namespace
}  // namespace turbidock::media
