#pragma once
// Serves the page of a result, which may still grow.

#include <functional>
#include <string>

#include "experiments/page/page.h"
#include "experiments/serve/server.h"

namespace turbidock::live {

struct ServeOptions {
  serve::Place place;
  std::function<void(const std::string& url)> on_served;
  std::function<bool()> stop_requested;
};

// Serves the page until it is told to stop. It is made anew when it is asked for, but rests ten
// times as long as that took, two seconds at least. What `make_page` throws before anything was
// served ends it; later it is said in place of the page.
void ServeResult(const std::function<page::Page()>& make_page, const ServeOptions& options);

}  // namespace turbidock::live
