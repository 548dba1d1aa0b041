#include <GL/osmesa.h>

#include <array>

#include "sim/base/check.h"
#include "sim/view/gl_context.h"
#include "sim/view/gl_library.h"

namespace turbidock::view {
namespace {

// The functions of libOSMesa that we call.
struct OsmesaLibrary {
  GlLibrary library{{"libOSMesa.so.8", "libOSMesa.so"}, "OSMesa", "libosmesa6"};
  decltype(&OSMesaCreateContextExt) CreateContextExt = library["OSMesaCreateContextExt"];
  decltype(&OSMesaDestroyContext) DestroyContext = library["OSMesaDestroyContext"];
  decltype(&OSMesaMakeCurrent) MakeCurrent = library["OSMesaMakeCurrent"];
  decltype(&OSMesaGetCurrentContext) GetCurrentContext = library["OSMesaGetCurrentContext"];
  decltype(&OSMesaGetProcAddress) GetProcAddress = library["OSMesaGetProcAddress"];
};

class OsmesaContext final : public GlContext {
 public:
  OsmesaContext() {
    constexpr int kDepthBits = 24, kStencilBits = 8, kAccumulationBits = 0;
    context_ =
        osmesa_.CreateContextExt(OSMESA_RGBA, kDepthBits, kStencilBits, kAccumulationBits, nullptr);
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
    if (!osmesa_.MakeCurrent(context_, window_.data(), GL_UNSIGNED_BYTE, kWindowPx, kWindowPx))
      throw SimulatorFault("OSMesa cannot make its OpenGL context current");
  }
  void (*Function(const char* name) const)() override { return osmesa_.GetProcAddress(name); }

 private:
  // A context needs a window's memory; we draw into framebuffers of our own, so a small one does.
  static constexpr int kWindowPx = 16;

  OsmesaLibrary osmesa_;
  OSMesaContext context_ = nullptr;
  std::array<unsigned char, 4 * kWindowPx * kWindowPx> window_{};
};

}  // namespace

std::unique_ptr<GlContext> MakeOsmesaContext() { return std::make_unique<OsmesaContext>(); }

}  // namespace turbidock::view
