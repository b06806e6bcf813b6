#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <memory>
#include <utility>
#include <vector>

namespace stairwell {

/// Values by id, visited in the order of ids. Like a std::map, but walking over thousands of values does not wait for
/// each before the next is known, and new ids are expected to be larger than the others (any other takes linear time).
/// A value stays where it is until it is erased.
template <typename T>
class IdTable {
  struct Slot {
    std::uint32_t id;
    std::unique_ptr<T> value;  ///< null: erased
  };

 public:
  /// Over what is not erased; gives pairs of id and reference.
  class const_iterator {
    using SlotIterator = typename std::vector<Slot>::const_iterator;

   public:
    using value_type = std::pair<std::uint32_t, const T&>;
    using reference = value_type;
    using difference_type = std::ptrdiff_t;
    using iterator_category = std::input_iterator_tag;
    /// Holds a pair for `->`.
    struct pointer {
      value_type entry;
      const value_type* operator->() const { return &entry; }
    };

    const_iterator(SlotIterator at, SlotIterator end) : at_(at), end_(end) { skip(); }
    reference operator*() const { return {at_->id, *at_->value}; }
    pointer operator->() const { return {**this}; }
    const_iterator& operator++() {
      ++at_;
      skip();
      return *this;
    }
    bool operator==(const const_iterator& other) const { return at_ == other.at_; }

   private:
    void skip() {
      while (at_ != end_ && at_->value == nullptr) ++at_;
    }
    SlotIterator at_, end_;
  };

  IdTable() = default;
  IdTable(IdTable&& other) noexcept
      : slots_(std::exchange(other.slots_, {})), erased_(std::exchange(other.erased_, 0)) {}
  IdTable(const IdTable& other) {
    slots_.reserve(other.size());
    for (const auto& [id, value] : other) slots_.push_back({id, std::make_unique<T>(value)});
  }
  IdTable& operator=(IdTable other) noexcept {
    slots_.swap(other.slots_);
    erased_ = other.erased_;
    return *this;
  }
  ~IdTable() = default;

  std::size_t size() const { return slots_.size() - erased_; }
  bool empty() const { return size() == 0; }
  const_iterator begin() const { return {slots_.begin(), slots_.end()}; }
  const_iterator end() const { return {slots_.end(), slots_.end()}; }

  /// Null where there is none.
  const T* find(std::uint32_t id) const {
    const auto at = place_of(slots_, id);
    return at != slots_.end() && at->id == id ? at->value.get() : nullptr;
  }
  T* find(std::uint32_t id) { return const_cast<T*>(std::as_const(*this).find(id)); }

  /// A new one where there is none.
  T& operator[](std::uint32_t id) {
    auto at = place_of(slots_, id);
    if (at == slots_.end() || at->id != id) {
      at = slots_.insert(at, Slot{id, std::make_unique<T>()});
    } else if (at->value == nullptr) {
      at->value = std::make_unique<T>();
      --erased_;
    }
    return *at->value;
  }

  void erase(std::uint32_t id) {
    const auto at = place_of(slots_, id);
    if (at == slots_.end() || at->id != id || at->value == nullptr) return;
    at->value.reset();
    if (2 * ++erased_ > slots_.size()) drop_erased();
  }

  /// In the order of ids. @param goes  (id, value) -> whether it is erased
  template <typename Goes>
  void erase_if(const Goes& goes) {
    for (Slot& slot : slots_) {
      if (slot.value != nullptr && goes(slot.id, *slot.value)) slot.value.reset();
    }
    drop_erased();
  }

  void clear() {
    slots_.clear();
    erased_ = 0;
  }

 private:
  template <typename Slots>
  static auto place_of(Slots& slots, std::uint32_t id) {
    if (slots.empty() || slots.back().id < id) return slots.end();
    return std::lower_bound(slots.begin(), slots.end(), id,
                            [](const Slot& slot, std::uint32_t wanted) { return slot.id < wanted; });
  }
  void drop_erased() {
    std::erase_if(slots_, [](const Slot& slot) { return slot.value == nullptr; });
    erased_ = 0;
  }

  std::vector<Slot> slots_;  ///< by id
  std::size_t erased_ = 0;
};

}  // namespace stairwell
