#pragma once
// A 64-bit digest of canonical values: two runs with the same digest did the same.

#include <cstdint>
#include <string>
#include <string_view>

#include "sim/base/pose.h"

struct XXH64_state_s;

namespace turbidock {

// Hashes integers, doubles (-0 as +0) and text with XXH64. Promised per build and machine type.
class Digest {
 public:
  Digest();
  ~Digest();
  Digest(const Digest&) = delete;
  Digest& operator=(const Digest&) = delete;

  void Add(int64_t value);
  void Add(double value);
  void Add(const Pose& X);  // canonical q (w, x, y, z), then p
  void Add(const Eigen::Ref<const Eigen::VectorXd>& values);
  void Add(std::string_view text);  // its length, then its bytes
  std::string Hex() const;          // of what was added so far, 16 hexadecimal digits

 private:
  XXH64_state_s* state_;
};

// Of one text.
std::string DigestOf(std::string_view text);

}  // namespace turbidock
