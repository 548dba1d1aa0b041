#include "sim/base/digest.h"

#include <xxhash.h>

#include <cstdio>

namespace turbidock {

Digest::Digest() : state_(XXH64_createState()) { XXH64_reset(state_, 0); }
Digest::~Digest() { XXH64_freeState(state_); }

void Digest::Add(int64_t value) { XXH64_update(state_, &value, sizeof value); }

void Digest::Add(double value) {
  value += 0.0;  // -0 becomes +0
  XXH64_update(state_, &value, sizeof value);
}

void Digest::Add(const Pose& X) {
  const Pose c = X.Canonical();
  for (const double x : {c.q.w(), c.q.x(), c.q.y(), c.q.z(), c.p.x(), c.p.y(), c.p.z()}) Add(x);
}

void Digest::Add(const Eigen::Ref<const Eigen::VectorXd>& values) {
  for (Eigen::Index i = 0; i < values.size(); ++i) Add(values[i]);
}

void Digest::Add(std::string_view text) {
  Add(static_cast<int64_t>(text.size()));
  XXH64_update(state_, text.data(), text.size());
}

std::string Digest::Hex() const {
  char text[17];
  std::snprintf(text, sizeof text, "%016llx",
                static_cast<unsigned long long>(XXH64_digest(state_)));
  return text;
}

std::string DigestOf(std::string_view text) {
  Digest digest;
  digest.Add(text);
  return digest.Hex();
}

}  // namespace turbidock
