// A frame of the closed loop takes no memory that the frames before it did not leave.
//
// Counts operator new, which is all that our code and the standard library's containers allocate
// with (OpenGL's own work, inside the library, and Eigen's matrices of variable size, which only
// the lqg law has, call malloc).
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <new>
#include <string>

#include "control/autopilot.h"
#include "experiments/trial/perception.h"
#include "experiments/trial/scenario.h"
#include "experiments/trial/world.h"

namespace {

std::atomic<int64_t> allocations{0};

void* Allocate(std::size_t size, std::size_t alignment) {
  ++allocations;
  void* memory = nullptr;
  if (posix_memalign(&memory, std::max(alignment, sizeof(void*)), size) != 0)
    throw std::bad_alloc();
  return memory;
}

}  // namespace

// The other forms call these.
void* operator new(std::size_t size) { return Allocate(size, alignof(std::max_align_t)); }
void* operator new(std::size_t size, std::align_val_t alignment) {
  return Allocate(size, static_cast<std::size_t>(alignment));
}
// Not inlined: GCC would see a new that ends in free.
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::align_val_t) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  std::free(memory);
}

namespace turbidock::trial {
namespace {

int64_t AllocationsOfThirtyFrames(const std::string& name, bool region_of_interest) {
  const Scenario scenario = LoadScenario(name, {});
  World world(scenario, {});
  TrialOptions options;
  options.whole_images = !region_of_interest;
  Perception perception(scenario, options, &world);
  control::Autopilot autopilot(scenario.ControlInUse(), scenario.procedure,
                               ModelOf(scenario.known_vehicle, world.scene()),
                               scenario.image_clock());
  constexpr int kWarmUp = 60, kFrames = 30;
  int64_t before = 0, estimates = 0;
  for (int frame = 0; frame < kWarmUp + kFrames; ++frame) {
    if (frame == kWarmUp) before = allocations;
    ThrusterCommand command;
    if (perception.Update(frame)) {
      command = autopilot.Update(perception.estimate());
      ++estimates;
    }
    vehicle::ContactReport contacts;
    EXPECT_FALSE(world.Advance(command, &contacts));
  }
  EXPECT_EQ(estimates, kWarmUp + kFrames);
  return allocations - before;
}

TEST(FrameLoop, AllocatesNothing) {
  for (const char* scenario : {"sea_night_active", "pool_passive"})
    for (const bool region_of_interest : {true, false}) {
      const int64_t at_start = allocations;
      EXPECT_EQ(AllocationsOfThirtyFrames(scenario, region_of_interest), 0)
          << scenario << (region_of_interest ? ", region" : ", whole images");
      EXPECT_GT(allocations, at_start + 100);  // it counts
    }
}

}  // namespace
}  // namespace turbidock::trial
