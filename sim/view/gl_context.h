#pragma once
// Where OpenGL draws, without any display. A context belongs to one thread at a time; one per
// thread works, and two threads draw identical pixels, but parallel workers are better off as
// processes (the software rasteriser slows down when two threads of a process draw). A process
// keeps to one kind of context: MuJoCo has one table of GL functions.

#include <memory>
#include <string>

#include "sim/base/fields.h"

namespace turbidock::view {

class GlContext {
 public:
  GlContext() = default;
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;
  virtual ~GlContext() = default;

  // Makes this the calling thread's context. Cheap when it already is.
  virtual void MakeCurrent() = 0;
  // Kind, renderer and version for reports, such as "OSMesa, llvmpipe (...), OpenGL 4.5 (...)".
  const std::string& description() const { return description_; }
  // The GL function of that name; null if there is none.
  virtual void (*Function(const char* name) const)() = 0;

 protected:
  std::string description_;
};

enum class GlBackend {
  kOsmesa,  // Mesa's llvmpipe on the CPU, into memory
  kEgl,     // the first EGL device that draws: a GPU, else llvmpipe
};
constexpr auto Names(GlBackend) {
  using enum GlBackend;
  return EnumList<GlBackend>({{kOsmesa, "osmesa"}, {kEgl, "egl"}});
}

// Both set LP_NUM_THREADS=0 in the environment of this process, so that Mesa's llvmpipe draws in
// the calling thread, and open their library when called, not before. SimulatorFault, with the
// package to install, when it is not usable.
std::unique_ptr<GlContext> MakeOsmesaContext();
std::unique_ptr<GlContext> MakeEglContext();

// A context of the preferred kind or, where that is not usable, of the other; `remark` then becomes
// a sentence that says so. SimulatorFault when neither is.
std::unique_ptr<GlContext> MakeGlContext(GlBackend preferred, std::string* remark = nullptr);

}  // namespace turbidock::view
