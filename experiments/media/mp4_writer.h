#pragma once
// MP4 files that browsers play, encoded by the program ffmpeg.
//
// Why a pipe to ffmpeg and not a library: OpenCV's video library brings 220 more shared libraries
// and 60 MB into every run, with or without a video, and hides x264's settings; libav's interface
// is large and changes. A pipe costs nothing until a video is asked for and encodes on the other
// core.

#include <string>
#include <vector>

#include "experiments/media/canvas.h"
#include "experiments/system/output_path.h"
#include "experiments/system/subprocess.h"

namespace turbidock::media {

// A command for system::Subprocess: quiet, with these options, apart by spaces. FILE in them stands
// for the file.
std::vector<std::string> FfmpegCommand(const std::string& options, const std::string& file);

// H.264, yuv420p, BT.709, with the index in front. The same frames give the same bytes.
class Mp4Writer {
 public:
  // Width and height must be even. What stands at the path stays until Finish. ConfigError when it
  // cannot be written, SimulatorFault when ffmpeg is missing.
  Mp4Writer(const std::string& path, int width_px, int height_px, int frames_per_second);

  // ConfigError when the disk is full, SimulatorFault when ffmpeg has given up otherwise.
  void Add(const Canvas& frame);

  // Ends the file and gives it its name; nothing may be added afterwards. Without it there is none.
  void Finish();

 private:
  int width_px_, height_px_;
  system::WholeFile file_;
  system::Subprocess ffmpeg_;
};

}  // namespace turbidock::media
