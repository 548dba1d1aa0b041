#include "experiments/media/mp4_writer.h"

#include <vector>

#include "sim/base/check.h"

namespace turbidock::media {
namespace {

std::vector<std::string> Command(const std::string& path, int width_px, int height_px,
                                 int frames_per_second) {
  std::vector<std::string> command = {"ffmpeg",    "-nostdin", "-hide_banner",
                                      "-loglevel", "error",    "-y"};
  auto add = [&](std::initializer_list<std::string> more) { command.insert(command.end(), more); };
  add({"-f", "rawvideo", "-pixel_format", "bgr0"});
  add({"-video_size", std::to_string(width_px) + "x" + std::to_string(height_px)});
  add({"-framerate", std::to_string(frames_per_second), "-i", "pipe:0"});
  // untagged RGB would be converted with the matrix of standard definition and shown with another
  add({"-vf",
       "scale=out_color_matrix=bt709:out_range=tv:flags=bilinear+accurate_rnd,format=yuv420p"});
  add({"-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709"});
  // a fixed number of threads and a short look-ahead keep memory small and the bytes reproducible
  add({"-c:v", "libx264", "-preset", "veryfast", "-crf", "23", "-threads", "2"});
  add({"-x264-params", "rc-lookahead=10", "-g", std::to_string(2 * frames_per_second)});
  add({"-fflags", "+bitexact", "-flags:v", "+bitexact", "-map_metadata", "-1"});
  add({"-movflags", "+faststart", "-f", "mp4", "file:" + path});
  return command;
}

}  // namespace

Mp4Writer::Mp4Writer(const std::string& path, int width_px, int height_px, int frames_per_second)
    : width_px_(width_px),
      height_px_(height_px),
      file_(path),
      ffmpeg_(Command(file_.partial(), width_px, height_px, frames_per_second), "ffmpeg") {
  TD_CHECK(width_px % 2 == 0 && height_px % 2 == 0, "yuv420p halves the size of the colour planes");
}

void Mp4Writer::Add(const Canvas& frame) {
  TD_CHECK(frame.width() == width_px_ && frame.height() == height_px_, "frames of one size");
  if (ffmpeg_.Write(frame.data(), frame.bytes())) return;
  ffmpeg_.FinishWriting(file_.path());
  throw SimulatorFault(file_.path() + ": ffmpeg stopped reading before the end of the video");
}

void Mp4Writer::Finish() {
  ffmpeg_.FinishWriting(file_.path());
  file_.Commit();
}

}  // namespace turbidock::media
