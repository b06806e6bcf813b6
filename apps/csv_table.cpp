#include "apps/csv_table.hpp"

#include "core/errors.hpp"

#include <algorithm>
#include <charconv>
#include <fstream>
#include <limits>
#include <sstream>

namespace stairwell::apps {
namespace {

std::vector<std::string> split_line(std::string_view line) {
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  std::vector<std::string> cells;
  while (true) {
    const std::size_t comma = line.find(',');
    cells.emplace_back(line.substr(0, comma));
    if (comma == std::string_view::npos) return cells;
    line.remove_prefix(comma + 1);
  }
}

}  // namespace

std::string read_whole_file(const std::filesystem::path& file) {
  if (!std::filesystem::is_regular_file(file)) throw InputError(file.string() + ": no such file");
  std::ifstream in(file, std::ios::binary);
  std::ostringstream bytes;
  if (!in || !(bytes << in.rdbuf())) throw InputError(file.string() + ": cannot be read or is empty");
  return std::move(bytes).str();
}

CsvTable CsvTable::read(const std::filesystem::path& file) {
  CsvTable table;
  table.file_ = file.string();
  const std::string bytes = read_whole_file(file);
  std::string_view rest = bytes;
  for (std::size_t line_number = 1; !rest.empty(); ++line_number) {
    const std::size_t end = rest.find('\n');
    const std::vector<std::string> cells = split_line(rest.substr(0, end));
    rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
    if (line_number == 1) {
      table.names_ = cells;
      table.columns_.resize(cells.size());
      continue;
    }
    if (cells.size() != table.names_.size())
      throw InputError(table.file_ + ":" + std::to_string(line_number) + ": " + std::to_string(cells.size()) +
                       " cells, the header names " + std::to_string(table.names_.size()));
    for (std::size_t i = 0; i < cells.size(); ++i) table.columns_[i].push_back(cells[i]);
    ++table.rows_;
  }
  return table;
}

std::size_t CsvTable::find(std::string_view column) const {
  return static_cast<std::size_t>(std::find(names_.begin(), names_.end(), column) - names_.begin());
}

const std::vector<std::string>& CsvTable::texts(std::string_view column) const {
  const std::size_t i = find(column);
  if (i == names_.size()) throw InputError(file_ + ": has no column '" + std::string(column) + "'");
  return columns_[i];
}

std::vector<double> CsvTable::numbers(std::string_view column) const {
  std::vector<double> values;
  for (const std::string& text : texts(column)) {
    double value = std::numeric_limits<double>::quiet_NaN();
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    const bool parsed = error == std::errc{} && end == text.data() + text.size();
    if (!parsed && !text.empty() && text != "null")
      throw InputError(file_ + ":" + std::to_string(values.size() + 2) + ": '" + text + "' is not a number (column " +
                       std::string(column) + ")");
    values.push_back(parsed ? value : std::numeric_limits<double>::quiet_NaN());
  }
  return values;
}

}  // namespace stairwell::apps
