#include "learning/rl/replay_buffer.hpp"

#include "core/errors.hpp"

#include <algorithm>
#include <cmath>

namespace stairwell::rl {

namespace {

template <typename T>
std::span<const T> part(const std::vector<T>& values, std::size_t count) {
  return std::span(values).first(count);
}

template <typename T>
void read_part(nn::ByteReader& reader, std::size_t count, std::vector<T>& values) {
  const std::vector<T> read = reader.list<T>();
  if (read.size() != count) throw InputError("replay of another size");
  std::ranges::copy(read, values.begin());
}

template <typename T>
void append(std::vector<T>& to, const std::vector<T>& from, std::size_t at, std::size_t count) {
  const auto begin = from.begin() + static_cast<std::ptrdiff_t>(at * count);
  to.insert(to.end(), begin, begin + static_cast<std::ptrdiff_t>(count));
}

}  // namespace

ReplayBuffer::ReplayBuffer(const Shape& shape, std::size_t capacity) : shape_(shape), capacity_(capacity) {
  if (capacity < 2) throw InputError("a replay must hold 2 looks or more");
  windows_.resize(capacity * shape.window_bytes);
  features_.resize(capacity * shape.features);
  actions_.resize(capacity * shape.actions);
  rewards_.resize(capacity);
  kinds_.resize(capacity, Kind::kNothingDone);
}

std::size_t ReplayBuffer::size() const { return static_cast<std::size_t>(std::min<std::uint64_t>(count_, capacity_)); }

void ReplayBuffer::push(const State& state) {
  if (state.windows.size() != shape_.window_bytes || state.features.size() != shape_.features) {
    throw InputError("replay: a state of another size");
  }
  const std::size_t at = count_++ % capacity_;
  if (kinds_[at] != Kind::kNothingDone) --transitions_;  // it is overwritten
  kinds_[at] = Kind::kNothingDone;
  std::ranges::copy(state.windows, windows_.begin() + static_cast<std::ptrdiff_t>(at * shape_.window_bytes));
  std::ranges::copy(state.features, features_.begin() + static_cast<std::ptrdiff_t>(at * shape_.features));
}

void ReplayBuffer::begin(const State& state) { push(state); }

void ReplayBuffer::step(std::span<const float> action, double reward, bool terminal, const State& next) {
  if (action.size() != shape_.actions) throw InputError("replay: an action of another size");
  const std::size_t at = (count_ - 1) % capacity_;
  std::ranges::copy(action, actions_.begin() + static_cast<std::ptrdiff_t>(at * shape_.actions));
  rewards_[at] = static_cast<float>(reward);
  kinds_[at] = terminal ? Kind::kTerminal : Kind::kStep;
  ++transitions_;
  push(next);
}

void ReplayBuffer::copy_state(std::size_t at, std::vector<std::uint8_t>& windows, std::vector<float>& features) const {
  append(windows, windows_, at, shape_.window_bytes);
  append(features, features_, at, shape_.features);
}

void ReplayBuffer::draw(std::size_t count, const Draw& how, Rng& rng, TransitionBatch& batch) const {
  for (std::size_t row = 0; row < count; ++row) {
    std::size_t at = 0;
    do {
      at = static_cast<std::size_t>(rng.uniform_int(0, static_cast<int>(size()) - 1));
    } while (kinds_[at] == Kind::kNothingDone);
    copy_state(at, batch.windows, batch.features);
    append(batch.actions, actions_, at, shape_.actions);
    double sum = 0.0, discount = 1.0;
    for (std::size_t k = 0; k < how.n_step && kinds_[at] != Kind::kNothingDone; ++k) {
      sum += discount * static_cast<double>(rewards_[at]);
      discount = kinds_[at] == Kind::kTerminal ? 0.0 : discount * how.discount;
      at = (at + 1) % capacity_;
      if (discount == 0.0) break;
    }
    copy_state(at, batch.next_windows, batch.next_features);
    batch.rewards.push_back(static_cast<float>(sum));
    batch.discounts.push_back(static_cast<float>(discount));
    batch.demonstrated.push_back(how.demonstrated ? 1.0F : 0.0F);
  }
  batch.count += count;
}

void ReplayBuffer::save(nn::ByteWriter& writer) const {
  const std::size_t n = size();
  writer.number(count_);
  writer.number<std::uint64_t>(transitions_);
  writer.list(part(windows_, n * shape_.window_bytes));
  writer.list(part(features_, n * shape_.features));
  writer.list(part(actions_, n * shape_.actions));
  writer.list(part(rewards_, n));
  writer.list(part(kinds_, n));
}

void ReplayBuffer::load(nn::ByteReader& reader) {
  count_ = reader.number<std::uint64_t>();
  transitions_ = static_cast<std::size_t>(reader.number<std::uint64_t>());
  const std::size_t n = size();
  read_part(reader, n * shape_.window_bytes, windows_);
  read_part(reader, n * shape_.features, features_);
  read_part(reader, n * shape_.actions, actions_);
  read_part(reader, n, rewards_);
  read_part(reader, n, kinds_);
}

TransitionBatch draw_mixed(const ReplayBuffer& own, const ReplayBuffer& demonstrations, std::size_t count,
                           double demonstration_share, const ReplayBuffer::Draw& how, Rng& rng) {
  auto shown = static_cast<std::size_t>(std::lround(demonstration_share * static_cast<double>(count)));
  if (demonstrations.transitions() == 0) shown = 0;
  if (own.transitions() == 0) shown = count;
  TransitionBatch batch;
  ReplayBuffer::Draw one = how;
  one.demonstrated = false;
  if (shown < count) own.draw(count - shown, one, rng, batch);
  one.demonstrated = true;
  if (shown > 0) demonstrations.draw(shown, one, rng, batch);
  return batch;
}

}  // namespace stairwell::rl
