/// The text forms of values, shared by the command line, `--set` and YAML. All throw InputError that quotes the text.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace stairwell::apps {

/// Finite number; the whole text must be one.
double parse_number(std::string_view text);
std::uint64_t parse_count(std::string_view text);
/// `on|off|true|false|yes|no`.
bool parse_switch(std::string_view text);
/// Comma-separated finite numbers, at least one.
std::vector<double> parse_numbers(std::string_view text);

struct FieldOfView {
  double azimuth_deg = 0.0;
  double elevation_lo_deg = 0.0;
  double elevation_hi_deg = 0.0;
};
/// `HxV` (`90x73.7`: symmetric about the optical axis) or `HxLO..HI` (`360x-7..45`).
FieldOfView parse_fov(std::string_view text);
/// `160x120`.
std::pair<int, int> parse_size(std::string_view text);

/// Shortest text that reads back as the same number.
std::string format_number(double value);

/// CLI11 takes a value that starts with a minus for an option. Joins `--name -9,0,0` to `--name=-9,0,0` wherever the
/// word after a long option is a minus and then a digit or a dot.
std::vector<std::string> join_minus_values(const std::vector<std::string>& words);

}  // namespace stairwell::apps
