#include "experiments/app/print_report.h"

#include <cstdio>
#include <string>

#include "experiments/report/report_json.h"
#include "experiments/report/text.h"
#include "experiments/system/plain_text.h"

namespace turbidock::app {

void PrintReport(const report::Report& report, const report::Json& result, bool json) {
  const std::string text = json ? report::JsonText(report::Document(report, result))
                                : system::Printable(report::Text(report));
  std::fputs(text.c_str(), stdout);
}

}  // namespace turbidock::app
