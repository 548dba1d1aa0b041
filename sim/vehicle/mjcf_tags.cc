#include "sim/vehicle/mjcf_tags.h"

#include <algorithm>

namespace turbidock::vehicle {

std::string Tag::attribute(std::string_view wanted) const {
  for (const auto& [key, value] : attributes)
    if (key == wanted) return value;
  return "";
}

std::vector<Tag> TagsOf(std::string_view xml) {
  constexpr std::string_view kSpace = " \t\r\n", kEndOfName = " \t\r\n/>=";
  std::vector<Tag> tags;
  size_t at = 0;
  const auto take = [&](size_t end) {
    end = std::min(end, xml.size());
    const std::string_view taken = xml.substr(at, end - at);
    at = end;
    return std::string(taken);
  };
  int line = 1;
  while (at < xml.size()) {
    const std::string before = take(xml.find('<', at));
    line += static_cast<int>(std::ranges::count(before, '\n'));
    if (at >= xml.size()) break;
    if (xml.substr(at).starts_with("<!--")) {
      const std::string comment = take(xml.find("-->", at));
      line += static_cast<int>(std::ranges::count(comment, '\n'));
      continue;
    }
    ++at;
    Tag tag{.name = take(xml.find_first_of(kEndOfName, at)), .attributes = {}, .line = line};
    while (at < xml.size() && xml[at] != '>') {
      line += xml[at] == '\n';
      if (kEndOfName.find(xml[at]) != std::string_view::npos) {
        ++at;
        continue;
      }
      const std::string key = take(xml.find_first_of(kEndOfName, at));
      at = std::min(xml.find_first_not_of(kSpace, at), xml.size());
      if (at >= xml.size() || xml[at] != '=') continue;
      at = std::min(xml.find_first_of("\"'", at), xml.size());
      if (at >= xml.size()) break;
      const char quote = xml[at++];
      const std::string value = take(xml.find(quote, at));
      line += static_cast<int>(std::ranges::count(value, '\n'));
      ++at;
      tag.attributes.emplace_back(key, value);
    }
    tags.push_back(std::move(tag));
  }
  return tags;
}

}  // namespace turbidock::vehicle
