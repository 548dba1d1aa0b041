#pragma once

namespace turbidock::config::internal {

// Functions of a variant's kinds as one visitor.
template <class... Fs>
struct Overloaded : Fs... {
  using Fs::operator()...;
};
template <class... Fs>
Overloaded(Fs...) -> Overloaded<Fs...>;

}  // namespace turbidock::config::internal
