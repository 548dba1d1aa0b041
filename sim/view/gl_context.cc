#include "sim/view/gl_context.h"

#include "sim/base/check.h"

namespace turbidock::view {

std::unique_ptr<GlContext> MakeGlContext(GlBackend preferred, std::string* remark) {
  const auto make = [](GlBackend backend) {
    return backend == GlBackend::kEgl ? MakeEglContext() : MakeOsmesaContext();
  };
  try {
    return make(preferred);
  } catch (const SimulatorFault& fault) {
    try {
      auto other = make(preferred == GlBackend::kEgl ? GlBackend::kOsmesa : GlBackend::kEgl);
      if (remark != nullptr)
        *remark = std::string(fault.what()) + "; drawing with " + other->description() + " instead";
      return other;
    } catch (const SimulatorFault& other_fault) {
      throw SimulatorFault(std::string(fault.what()) + "; " + other_fault.what());
    }
  }
}

}  // namespace turbidock::view
