// Any text as YAML: refused with a message, or a tree whose one line says the same again.

#include "experiments/config/yaml_node.h"
#include "experiments/system/plain_text.h"
#include "sim/base/check.h"

using namespace turbidock;  // NOLINT(google-build-using-namespace)

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  try {
    const config::YamlNode root = config::ParseYaml(text, "input.yaml");
    const std::string line = root.OneLine();
    const config::YamlNode again = config::ParseYaml(line, "line.yaml");
    TD_CHECK(again.OneLine() == line, "one line that says the same");
    TD_CHECK(again.Entries().size() == root.Entries().size(), "as many keys");
    for (const auto& [key, value] : root.Entries())
      TD_CHECK(again.Find(key).has_value(), "the same keys");
  } catch (const ConfigError& error) {
    TD_CHECK(!system::OneLineOf(error.what()).empty(), "a message");
  }
  return 0;
}
