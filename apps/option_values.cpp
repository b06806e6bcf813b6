#include "apps/option_values.hpp"

#include "core/errors.hpp"

#include <cctype>
#include <charconv>
#include <cmath>

namespace stairwell::apps {

namespace {

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.front()))) text.remove_prefix(1);
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back()))) text.remove_suffix(1);
  return text;
}

std::string quoted(std::string_view text) { return "'" + std::string(text) + "'"; }

}  // namespace

double parse_number(std::string_view text) {
  std::string_view digits = trimmed(text);
  if (!digits.empty() && digits.front() == '+') digits.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc{} || end != digits.data() + digits.size() || !std::isfinite(value)) {
    throw InputError(quoted(text) + " is not a finite number");
  }
  return value;
}

std::uint64_t parse_count(std::string_view text) {
  const std::string_view digits = trimmed(text);
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc{} || end != digits.data() + digits.size()) {
    throw InputError(quoted(text) + " is not a whole number of 0 or more");
  }
  return value;
}

bool parse_switch(std::string_view text) {
  const std::string_view word = trimmed(text);
  if (word == "on" || word == "true" || word == "yes") return true;
  if (word == "off" || word == "false" || word == "no") return false;
  throw InputError(quoted(text) + " is neither on nor off");
}

std::vector<double> parse_numbers(std::string_view text) {
  std::vector<double> values;
  std::string_view rest = text;
  while (true) {
    const std::size_t comma = rest.find(',');
    values.push_back(parse_number(rest.substr(0, comma)));
    if (comma == std::string_view::npos) return values;
    rest.remove_prefix(comma + 1);
  }
}

FieldOfView parse_fov(std::string_view text) {
  const std::size_t cross = text.find('x');
  if (cross == std::string_view::npos) {
    throw InputError(quoted(text) + " is not a field of view: give HxV as in 90x73.7 or HxLO..HI as in 360x-7..45");
  }
  FieldOfView fov;
  fov.azimuth_deg = parse_number(text.substr(0, cross));
  const std::string_view vertical = text.substr(cross + 1);
  const std::size_t dots = vertical.find("..");
  if (dots == std::string_view::npos) {
    const double full_deg = parse_number(vertical);
    fov.elevation_lo_deg = -0.5 * full_deg;
    fov.elevation_hi_deg = 0.5 * full_deg;
  } else {
    fov.elevation_lo_deg = parse_number(vertical.substr(0, dots));
    fov.elevation_hi_deg = parse_number(vertical.substr(dots + 2));
  }
  return fov;
}

std::pair<int, int> parse_size(std::string_view text) {
  constexpr std::uint64_t kMost = 100'000;
  const std::size_t cross = text.find('x');
  if (cross == std::string_view::npos) throw InputError(quoted(text) + " is not a size: give two counts as in 160x120");
  const std::uint64_t first = parse_count(text.substr(0, cross));
  const std::uint64_t second = parse_count(text.substr(cross + 1));
  if (first < 1 || second < 1 || first > kMost || second > kMost) {
    throw InputError(quoted(text) + " is not a size: both counts must be 1 to 100000");
  }
  return {static_cast<int>(first), static_cast<int>(second)};
}

std::string format_number(double value) {
  char buffer[64];
  const auto [end, error] = std::to_chars(buffer, buffer + sizeof(buffer), value);
  return error == std::errc{} ? std::string(buffer, end) : std::string("nan");
}

std::vector<std::string> join_minus_values(const std::vector<std::string>& words) {
  const auto negative_value = [](const std::string& word) {
    return word.size() >= 2 && word[0] == '-' && (std::isdigit(static_cast<unsigned char>(word[1])) || word[1] == '.');
  };
  std::vector<std::string> joined;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string& word = words[i];
    if (word == "--") {
      joined.insert(joined.end(), words.begin() + static_cast<std::ptrdiff_t>(i), words.end());
      break;
    }
    const bool open_option = word.size() > 2 && word.starts_with("--") && word.find('=') == std::string::npos;
    if (open_option && i + 1 < words.size() && negative_value(words[i + 1])) {
      joined.push_back(word + "=" + words[++i]);
    } else {
      joined.push_back(word);
    }
  }
  return joined;
}

}  // namespace stairwell::apps
