#include "learning/nn/network_spec.hpp"

#include "core/errors.hpp"

#include <algorithm>
#include <charconv>
#include <sstream>

namespace stairwell::nn {

namespace {

constexpr int kMostPerAxis = 256;
constexpr int kMostChannels = 1024;
constexpr std::size_t kMostParameters = 4'000'000;

constexpr std::array<std::string_view, 3> kHeads{"values", "unit_vector", "angles"};

std::vector<std::string> split(std::string_view text, char separator) {
  std::vector<std::string> parts;
  std::istringstream in{std::string(text)};
  for (std::string part; std::getline(in, part, separator);) parts.push_back(part);
  return parts;
}

int number(std::string_view text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) {
    throw InputError("'" + std::string(text) + "' is not a whole number");
  }
  return value;
}

WindowInput parse_window(const std::string& text) {
  const auto parts = split(text, 'x');
  if (parts.size() != 4) throw InputError("window '" + text + "' is not CHANNELSxZxYxX");
  return {number(parts[0]), {number(parts[1]), number(parts[2]), number(parts[3])}};
}

ConvLayer parse_conv(const std::string& text) {
  const std::size_t k = text.find('k'), s = text.find('s');
  if (k == std::string::npos || s == std::string::npos || s < k) {
    throw InputError("convolution '" + text + "' is not CHANNELSkKERNELsSTRIDE");
  }
  return {number(text.substr(0, k)), number(text.substr(k + 1, s - k - 1)), number(text.substr(s + 1))};
}

Head parse_head(const std::string& text) {
  const auto found = std::ranges::find(kHeads, text);
  if (found == kHeads.end()) throw InputError("unknown head '" + text + "'");
  return static_cast<Head>(found - kHeads.begin());
}

void set_field(NetworkSpec& spec, const std::string& key, const std::string& value) {
  const bool none = value == "-";
  if (key == "windows") {
    for (const std::string& part : split(none ? "" : value, ',')) spec.windows.push_back(parse_window(part));
  } else if (key == "conv") {
    for (const std::string& part : split(none ? "" : value, ',')) spec.trunk.push_back(parse_conv(part));
  } else if (key == "features") {
    spec.features = number(value);
  } else if (key == "hidden") {
    for (const std::string& part : split(none ? "" : value, ',')) spec.hidden.push_back(number(part));
  } else if (key == "norm") {
    spec.layer_norm = number(value) != 0;
  } else if (key == "outputs") {
    spec.outputs = number(value);
  } else if (key == "head") {
    spec.head = parse_head(value);
  } else {
    throw InputError("unknown word '" + key + "'");
  }
}

template <typename List, typename Print>
void print_list(std::ostream& out, const List& list, const Print& print) {
  if (list.empty()) out << '-';
  for (std::size_t i = 0; i < list.size(); ++i) {
    if (i > 0) out << ',';
    print(list[i]);
  }
}

}  // namespace

std::size_t WindowInput::values() const {
  return static_cast<std::size_t>(channels) * static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) *
         static_cast<std::size_t>(size[2]);
}

std::size_t NetworkSpec::window_values() const {
  std::size_t sum = 0;
  for (const WindowInput& window : windows) sum += window.values();
  return sum;
}

std::vector<std::string> NetworkSpec::problems() const {
  std::vector<std::string> list;
  const auto require = [&](bool usable, const char* what) {
    if (!usable) list.emplace_back(what);
  };
  for (const WindowInput& window : windows) {
    require(window.channels >= 1 && window.channels <= kMostChannels, "a window's channels must be 1 to 1024");
    for (const int n : window.size) require(n >= 1 && n <= kMostPerAxis, "a window's axes must be 1 to 256 cells");
  }
  for (const ConvLayer& layer : trunk) {
    require(layer.channels >= 8 && layer.channels <= kMostChannels && layer.channels % 8 == 0,
            "a convolution's channels must be a multiple of 8, at most 1024");
    require(layer.kernel >= 1 && layer.kernel <= 9 && layer.kernel % 2 == 1, "a kernel must be 1, 3, 5, 7 or 9 wide");
    require(layer.stride >= 1 && layer.stride <= 4, "a stride must be 1 to 4");
  }
  for (const int n : hidden) require(n >= 1 && n <= 4096, "a hidden layer must have 1 to 4096 units");
  require(features >= 0 && features <= 4096, "features must be 0 to 4096");
  require(features > 0 || !windows.empty(), "there is no input");
  require(outputs >= 1 && outputs <= 4096, "outputs must be 1 to 4096");
  require(head != Head::kUnitVector || outputs == 2 || outputs == 3, "a unit vector has 2 or 3 outputs");
  require(head != Head::kAngles || outputs == 1 || outputs == 2, "angles are 1 or 2 outputs");
  if (list.empty()) require(parameter_count() <= kMostParameters, "more than 4 million parameters");
  return list;
}

std::size_t NetworkSpec::parameter_count() const {
  std::size_t sum = 0;
  for (const LayerShape& layer : layers_of(*this)) {
    sum += layer.weights + static_cast<std::size_t>(layer.out) * (layer.norm ? 3 : 1);
  }
  return sum;
}

std::string NetworkSpec::text() const {
  std::ostringstream out;
  out << "windows ";
  print_list(out, windows, [&](const WindowInput& w) {
    out << w.channels << 'x' << w.size[0] << 'x' << w.size[1] << 'x' << w.size[2];
  });
  out << " conv ";
  print_list(out, trunk, [&](const ConvLayer& l) { out << l.channels << 'k' << l.kernel << 's' << l.stride; });
  out << " features " << features << " hidden ";
  print_list(out, hidden, [&](int n) { out << n; });
  out << " norm " << (layer_norm ? 1 : 0) << " outputs " << outputs << " head "
      << kHeads[static_cast<std::size_t>(head)];
  return out.str();
}

NetworkSpec NetworkSpec::parse(std::string_view text) {
  NetworkSpec spec;
  std::istringstream in{std::string(text)};
  std::string key, value;
  while (in >> key) {
    if (!(in >> value)) throw InputError("network: no value after '" + key + "'");
    set_field(spec, key, value);
  }
  if (const auto list = spec.problems(); !list.empty()) throw InputError("network: " + list.front());
  return spec;
}

std::vector<LayerShape> layers_of(const NetworkSpec& spec) {
  std::vector<LayerShape> layers;
  std::size_t at = 0, flat = static_cast<std::size_t>(spec.features);
  const auto place = [&](LayerShape& layer) {
    layer.weights = static_cast<std::size_t>(layer.in) * static_cast<std::size_t>(layer.out);
    for (const int n : layer.kernel) layer.weights *= static_cast<std::size_t>(n);
    layer.weights_at = at;
    layer.biases_at = at + layer.weights;
    layer.norm_at = layer.biases_at + static_cast<std::size_t>(layer.out);
    at = layer.norm_at + (layer.norm ? 2 * static_cast<std::size_t>(layer.out) : 0);
    layers.push_back(layer);
  };
  for (std::size_t w = 0; w < spec.windows.size(); ++w) {
    WindowInput shape = spec.windows[w];
    const bool plane = shape.size[0] == 1;
    for (const ConvLayer& conv : spec.trunk) {
      LayerShape layer;
      layer.conv = true;
      layer.window = static_cast<int>(w);
      layer.in = shape.channels;
      layer.out = conv.channels;
      layer.kernel = {plane ? 1 : conv.kernel, conv.kernel, conv.kernel};
      layer.stride = {plane ? 1 : conv.stride, conv.stride, conv.stride};
      layer.in_size = shape.size;
      for (std::size_t a = 0; a < 3; ++a) layer.out_size[a] = (shape.size[a] - 1) / layer.stride[a] + 1;
      shape = {conv.channels, layer.out_size};
      place(layer);
    }
    flat += shape.values();
  }
  int in = static_cast<int>(flat);
  for (std::size_t i = 0; i <= spec.hidden.size(); ++i) {
    const bool last = i == spec.hidden.size();
    LayerShape layer;
    layer.in = in;
    layer.out = last ? spec.outputs : spec.hidden[i];
    layer.relu = !last;
    layer.norm = spec.layer_norm && !last;
    in = layer.out;
    place(layer);
  }
  return layers;
}

}  // namespace stairwell::nn
