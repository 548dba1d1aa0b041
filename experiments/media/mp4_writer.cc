#include "experiments/media/mp4_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <sstream>

#include "sim/base/check.h"

namespace turbidock::media {
namespace {

// The input is told which colours it has: untagged RGB would be converted with the matrix of
// standard definition and shown with another. A fixed number of threads and a short look-ahead keep
// memory small and the bytes reproducible. The highest rate is what noise gets: a minute of it has
// 4 MB, of which base64 makes 5.3 in a page: the report of a failed minute has 7.5.
constexpr const char* kOptions =
    "-y -f rawvideo -pixel_format bgr0 -video_size {}x{} -framerate {} -i pipe:0 "
    "-vf scale=out_color_matrix=bt709:out_range=tv:flags=bilinear+accurate_rnd,format=yuv420p "
    "-colorspace bt709 -color_primaries bt709 -color_trc bt709 "
    "-c:v libx264 -preset veryfast -crf 23 -maxrate 500k -bufsize 1000k -threads 2 "
    "-x264-params rc-lookahead=10 -g {} "
    "-fflags +bitexact -flags:v +bitexact -map_metadata -1 -movflags +faststart -f mp4 FILE";

}  // namespace

std::vector<std::string> FfmpegCommand(const std::string& options, const std::string& file) {
  std::istringstream words("ffmpeg -nostdin -hide_banner -loglevel error " + options);
  std::vector<std::string> command{std::istream_iterator<std::string>(words), {}};
  std::ranges::replace(command, "FILE", "file:" + file);
  return command;
}

Mp4Writer::Mp4Writer(const std::string& path, int width_px, int height_px, int frames_per_second)
    : width_px_(width_px),
      height_px_(height_px),
      file_(path),
      ffmpeg_(FfmpegCommand(fmt::format(fmt::runtime(kOptions), width_px, height_px,
                                        frames_per_second, 2 * frames_per_second),
                            file_.partial()),
              "ffmpeg") {
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
