#pragma once

#include <string>
#include <string_view>

namespace stairwell::apps {

/// A self-contained page up to and with its heading, in the style that all pages share. @param title plain text
std::string open_page(std::string_view title);

}  // namespace stairwell::apps
