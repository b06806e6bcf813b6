#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace stairwell::apps {

/// A table of named columns; numbers where they parse, texts as they are. Empty cells are NaN.
class CsvTable {
 public:
  /// @throws InputError naming file and line: missing, no header, wrong number of cells.
  static CsvTable read(const std::filesystem::path& file);

  std::size_t rows() const { return rows_; }
  bool has(std::string_view column) const { return find(column) < names_.size(); }
  const std::vector<std::string>& names() const { return names_; }
  /// @throws InputError naming file and column when it is absent.
  const std::vector<std::string>& texts(std::string_view column) const;
  /// NaN for empty cells, `nan` and `null`. @throws InputError naming file, line and column for other texts.
  std::vector<double> numbers(std::string_view column) const;

 private:
  std::size_t find(std::string_view column) const;
  std::string file_;
  std::vector<std::string> names_;
  std::vector<std::vector<std::string>> columns_;
  std::size_t rows_ = 0;
};

/// The whole file. @throws InputError naming it when it is missing, empty or cannot be read.
std::string read_whole_file(const std::filesystem::path& file);

}  // namespace stairwell::apps
