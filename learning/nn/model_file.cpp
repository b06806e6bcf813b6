#include "learning/nn/model_file.hpp"

#include "core/errors.hpp"

#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <sstream>

namespace stairwell::nn {

namespace {

static_assert(std::endian::native == std::endian::little, "parameters are stored as they lie in memory");

constexpr std::string_view kMagic = "stairwell-model";
constexpr std::string_view kFirstLine = "stairwell-model 1";
constexpr std::size_t kMostHeader = 65536;
constexpr std::uintmax_t kMostBytes = 32u << 20;

std::string hex(std::uint64_t value) {
  std::ostringstream out;
  out << std::hex << value;
  return out.str();
}

std::uint64_t whole(const std::string& text, int base) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
  if (error != std::errc{} || end != text.data() + text.size()) throw InputError("'" + text + "' is not a number");
  return value;
}

/// The lines up to `end`. @throws InputError
std::map<std::string, std::string> read_header(std::istream& in) {
  std::string line;
  if (!std::getline(in, line) || !line.starts_with(kMagic)) throw InputError("not a model of this program");
  if (line != kFirstLine)
    throw InputError("format '" + line + "' where this program reads '" + std::string(kFirstLine) + "'");
  std::map<std::string, std::string> fields;
  while (std::getline(in, line) && line != "end") {
    const std::size_t colon = line.find(": ");
    if (colon == std::string::npos || static_cast<std::size_t>(in.tellg()) > kMostHeader) {
      throw InputError("damaged header");
    }
    fields[line.substr(0, colon)] = line.substr(colon + 2);
  }
  if (line != "end" || in.eof()) throw InputError("truncated header");
  return fields;
}

Model parse(const std::string& bytes, std::string_view agent) {
  std::istringstream in(bytes);
  std::map<std::string, std::string> fields = read_header(in);
  const auto field = [&](const char* key) -> const std::string& {
    const auto found = fields.find(key);
    if (found == fields.end()) throw InputError(std::string("the header has no '") + key + "'");
    return found->second;
  };
  Model model;
  model.agent = field("agent");
  if (!agent.empty() && model.agent != agent) {
    throw InputError("a model for agent '" + model.agent + "' where one for '" + std::string(agent) + "' is needed");
  }
  model.input = field("input");
  model.network = NetworkSpec::parse(field("network"));
  model.command = field("command");
  model.commit = field("commit");
  model.seed = whole(field("seed"), 10);
  model.steps = whole(field("steps"), 10);
  const std::string_view payload = std::string_view(bytes).substr(static_cast<std::size_t>(in.tellg()));
  const std::uint64_t wanted = whole(field("payload_bytes"), 10);
  if (payload.size() != wanted) {
    throw InputError((payload.size() < wanted ? "truncated: " : "too long: ") + std::to_string(payload.size()) +
                     " bytes of parameters where the header says " + std::to_string(wanted));
  }
  if (fnv1a64(payload) != whole(field("payload_fnv1a64"), 16))
    throw InputError("damaged: the parameters' hash is another");
  if (wanted != model.network.parameter_count() * sizeof(float)) {
    throw InputError("the parameters do not fit the network: " + std::to_string(wanted / sizeof(float)) +
                     " where it has " + std::to_string(model.network.parameter_count()));
  }
  model.parameters.resize(model.network.parameter_count());
  std::memcpy(model.parameters.data(), payload.data(), payload.size());
  for (const float p : model.parameters) {
    if (!std::isfinite(p)) throw InputError("a parameter is not finite");
  }
  return model;
}

}  // namespace

std::uint64_t fnv1a64(std::string_view bytes) {
  std::uint64_t hash = 0xcbf29ce484222325ULL;
  for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
  return hash;
}

std::string model_bytes(const Model& model) {
  if (model.parameters.size() != model.network.parameter_count()) {
    throw InputError("model: the parameters do not fit the network");
  }
  std::string payload(model.parameters.size() * sizeof(float), '\0');
  std::memcpy(payload.data(), model.parameters.data(), payload.size());
  std::ostringstream out;
  out << kFirstLine << "\nagent: " << model.agent << "\ninput: " << model.input << "\nnetwork: " << model.network.text()
      << "\ncommand: " << model.command << "\ncommit: " << model.commit << "\nseed: " << model.seed
      << "\nsteps: " << model.steps << "\npayload_bytes: " << payload.size()
      << "\npayload_fnv1a64: " << hex(fnv1a64(payload)) << "\nend\n";
  std::string header = out.str();
  return header + payload;
}

Model read_model(const std::filesystem::path& file, std::string_view agent) {
  try {
    std::error_code error;
    const std::uintmax_t size = std::filesystem::file_size(file, error);
    if (error) throw InputError(error.message());
    if (size > kMostBytes) throw InputError("larger than any model");
    std::ifstream in(file, std::ios::binary);
    std::string bytes(static_cast<std::size_t>(size), '\0');
    if (!in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()))) throw InputError("cannot be read");
    return parse(bytes, agent);
  } catch (const InputError& problem) {
    throw InputError(file.string() + ": " + problem.what());
  }
}

}  // namespace stairwell::nn
