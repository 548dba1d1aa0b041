#pragma once
// What a struct with fields needs to name of yaml_fields.h, which is long.

#include "sim/base/fields.h"

namespace turbidock::config {

struct Assignment;
struct GroupRef;
struct KeyDoc;

// References to the members of `object`, which must outlive them.
template <HasFields T>
GroupRef GroupOf(T* object);

}  // namespace turbidock::config
