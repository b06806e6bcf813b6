#pragma once

#include <string>

namespace CLI {
class App;
}

namespace stairwell::apps {

/// The manual page of the program, in man(7)'s language: every command with its options and examples, as its --help has
/// them.
std::string man_page(const CLI::App& program);

}  // namespace stairwell::apps
