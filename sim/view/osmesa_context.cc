#include <array>

#include "sim/base/check.h"
#include "sim/view/gl_context.h"
#include "sim/view/gl_library.h"

namespace turbidock::view {
namespace {

struct OsmesaHandle;
using GlFunction = void (*)();
constexpr unsigned int kRgba = 0x1908, kUnsignedByte = 0x1401;

// The functions of libOSMesa that we call, declared here because Debian 14 has no header of it.
struct OsmesaLibrary {
  GlLibrary library{{"libOSMesa.so.8", "libOSMesa.so"}, "OSMesa", "libosmesa6"};
  OsmesaHandle* (*CreateContextExt)(unsigned int format, int depth_bits, int stencil_bits,
                                    int accumulation_bits,
                                    OsmesaHandle* shared) = library["OSMesaCreateContextExt"];
  void (*DestroyContext)(OsmesaHandle*) = library["OSMesaDestroyContext"];
  unsigned char (*MakeCurrent)(OsmesaHandle*, void* window, unsigned int type, int width,
                               int height) = library["OSMesaMakeCurrent"];
  OsmesaHandle* (*GetCurrentContext)() = library["OSMesaGetCurrentContext"];
  GlFunction (*GetProcAddress)(const char* name) = library["OSMesaGetProcAddress"];
};

class OsmesaContext final : public GlContext {
 public:
  OsmesaContext() {
    constexpr int kDepthBits = 24, kStencilBits = 8, kAccumulationBits = 0;
    context_ =
        osmesa_.CreateContextExt(kRgba, kDepthBits, kStencilBits, kAccumulationBits, nullptr);
    if (context_ == nullptr) throw SimulatorFault("OSMesa cannot create an OpenGL context");
    try {
      MakeCurrent();
      ShowToMujoco(reinterpret_cast<const void*>(osmesa_.GetProcAddress));
      description_ = DescribeGl("OSMesa", osmesa_.GetProcAddress("glGetString"));
    } catch (...) {
      osmesa_.DestroyContext(context_);
      throw;
    }
  }
  ~OsmesaContext() override { osmesa_.DestroyContext(context_); }

  void MakeCurrent() override {
    if (osmesa_.GetCurrentContext() == context_) return;
    if (!osmesa_.MakeCurrent(context_, window_.data(), kUnsignedByte, kWindowPx, kWindowPx))
      throw SimulatorFault("OSMesa cannot make its OpenGL context current");
  }
  void (*Function(const char* name) const)() override { return osmesa_.GetProcAddress(name); }

 private:
  // A context needs a window's memory; we draw into framebuffers of our own, so a small one does.
  static constexpr int kWindowPx = 16;

  OsmesaLibrary osmesa_;
  OsmesaHandle* context_ = nullptr;
  std::array<unsigned char, 4 * kWindowPx * kWindowPx> window_{};
};

}  // namespace

std::unique_ptr<GlContext> MakeOsmesaContext() { return std::make_unique<OsmesaContext>(); }

}  // namespace turbidock::view
