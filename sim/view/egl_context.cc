// The types of windows, which would take X11 along.
#define EGL_NO_PLATFORM_SPECIFIC_TYPES
#include <EGL/egl.h>
#include <EGL/eglext.h>

#include <array>

#include "sim/base/check.h"
#include "sim/view/gl_context.h"
#include "sim/view/gl_library.h"

namespace turbidock::view {
namespace {

// The functions of libEGL that we call, the last two being extensions, which may be null.
struct EglLibrary {
  GlLibrary library{{"libEGL.so.1", "libEGL.so"}, "EGL", "libegl1"};
  decltype(&eglGetProcAddress) GetProcAddress = library["eglGetProcAddress"];
  decltype(&eglInitialize) Initialize = library["eglInitialize"];
  decltype(&eglBindAPI) BindApi = library["eglBindAPI"];
  decltype(&eglChooseConfig) ChooseConfig = library["eglChooseConfig"];
  decltype(&eglCreateContext) CreateContext = library["eglCreateContext"];
  decltype(&eglDestroyContext) DestroyContext = library["eglDestroyContext"];
  decltype(&eglGetCurrentContext) GetCurrentContext = library["eglGetCurrentContext"];
  decltype(&eglMakeCurrent) MakeCurrent = library["eglMakeCurrent"];
  PFNEGLQUERYDEVICESEXTPROC QueryDevices =
      reinterpret_cast<PFNEGLQUERYDEVICESEXTPROC>(GetProcAddress("eglQueryDevicesEXT"));
  PFNEGLGETPLATFORMDISPLAYEXTPROC GetPlatformDisplay =
      reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(GetProcAddress("eglGetPlatformDisplayEXT"));
};

class EglContext final : public GlContext {
 public:
  EglContext() {
    if (egl_.QueryDevices == nullptr || egl_.GetPlatformDisplay == nullptr)
      throw SimulatorFault("EGL cannot list this machine's devices");
    // In EGL's own order, which has software last.
    std::array<EGLDeviceEXT, 16> devices;
    EGLint count = 0;
    if (!egl_.QueryDevices(std::ssize(devices), devices.data(), &count)) count = 0;
    for (EGLint i = 0; i < count; ++i)
      if (Open(devices[static_cast<size_t>(i)])) return;
    throw SimulatorFault("none of EGL's " + std::to_string(count) +
                         " devices gives an OpenGL context; install the package libgl1-mesa-dri");
  }
  ~EglContext() override {
    if (egl_.GetCurrentContext() == context_) Release();
    egl_.DestroyContext(display_, context_);  // the display is the process's
  }

  void MakeCurrent() override {
    egl_.BindApi(EGL_OPENGL_API);  // each thread's own setting
    if (egl_.GetCurrentContext() == context_) return;
    if (!egl_.MakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_))
      throw SimulatorFault("EGL cannot make its OpenGL context current");
  }
  void (*Function(const char* name) const)() override { return egl_.GetProcAddress(name); }

 private:
  // Makes a context on a device and makes it current; false where that does not work.
  bool Open(EGLDeviceEXT device) {
    display_ = egl_.GetPlatformDisplay(EGL_PLATFORM_DEVICE_EXT, device, nullptr);
    if (display_ == EGL_NO_DISPLAY || !egl_.Initialize(display_, nullptr, nullptr)) return false;
    if (!egl_.BindApi(EGL_OPENGL_API)) return false;
    // No surface: we draw into framebuffers of our own.
    constexpr std::array<EGLint, 5> kWanted = {EGL_SURFACE_TYPE, 0, EGL_RENDERABLE_TYPE,
                                               EGL_OPENGL_BIT, EGL_NONE};
    EGLConfig config = nullptr;
    EGLint configs = 0;
    if (!egl_.ChooseConfig(display_, kWanted.data(), &config, 1, &configs) || configs == 0)
      return false;
    context_ = egl_.CreateContext(display_, config, EGL_NO_CONTEXT, nullptr);
    if (context_ == EGL_NO_CONTEXT) return false;
    if (!egl_.MakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_)) {
      egl_.DestroyContext(display_, context_);
      return false;
    }
    ShowToMujoco(reinterpret_cast<const void*>(egl_.GetProcAddress));
    description_ = DescribeGl("EGL", egl_.GetProcAddress("glGetString"));
    return true;
  }

  void Release() { egl_.MakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT); }

  EglLibrary egl_;
  EGLDisplay display_ = EGL_NO_DISPLAY;
  EGLContext context_ = EGL_NO_CONTEXT;
};

}  // namespace

std::unique_ptr<GlContext> MakeEglContext() { return std::make_unique<EglContext>(); }

}  // namespace turbidock::view
