#pragma once
// Where OpenGL draws. A context belongs to one thread at a time; one per thread works, and two
// threads draw identical pixels, but parallel workers are better off as processes (the software
// rasteriser slows down when two threads of a process draw).

#include <memory>
#include <string>

namespace turbidock::sim {

class GlContext {
 public:
  virtual ~GlContext() = default;

  // Makes this the calling thread's context. Cheap when it already is.
  virtual void MakeCurrent() = 0;
  // Renderer and version for reports, such as "OSMesa, llvmpipe (...), 4.5 (...)".
  virtual std::string description() const = 0;
};

// A context that draws on the CPU into memory, without any display. Sets LP_NUM_THREADS=0 in the
// environment of this process, so that Mesa's llvmpipe draws in the calling thread. The library is
// opened when this is called, not linked: a machine without it can still run everything else.
// Throws SimulatorFault, with the package to install, when there is no usable library.
std::unique_ptr<GlContext> MakeOsmesaContext();

}  // namespace turbidock::sim
