/// Who shares a map with whom (`--radio-range`).
#include "explore/fleet_impl.hpp"

#include <algorithm>
#include <utility>

namespace stairwell::explore {

namespace {

using Group = std::vector<std::size_t>;

/// Members of `belief` that are in `group`.
Group part_of(const Belief& belief, const Group& group) {
  Group part;
  std::ranges::set_intersection(belief.members, group, std::back_inserter(part));
  return part;
}

}  // namespace

/// UAVs that reach each other, directly or through others; each group ascending.
std::vector<std::vector<std::size_t>> Fleet::Impl::groups_in_touch() const {
  std::vector<Group> groups;
  std::vector<bool> placed(uavs.size(), false);
  for (std::size_t first = 0; first < uavs.size(); ++first) {
    if (placed[first]) continue;
    Group group{first};
    placed[first] = true;
    for (std::size_t i = 0; i < group.size(); ++i) {
      const Eigen::Vector3d at_m = uavs[group[i]].vehicle->state().position_m;
      for (std::size_t other = 0; other < uavs.size(); ++other) {
        if (placed[other] || uavs[group[i]].lost_s || uavs[other].lost_s) continue;
        if (!radio->linked(at_m, uavs[other].vehicle->state().position_m)) continue;
        placed[other] = true;
        group.push_back(other);
      }
    }
    std::ranges::sort(group);
    groups.push_back(std::move(group));
  }
  return groups;
}

/// Splits and joins the beliefs so that there is one for each group in touch.
void Fleet::Impl::regroup() {
  if (radio == nullptr) return;
  const std::vector<Group> groups = groups_in_touch();
  for (std::size_t i = 0, count = beliefs.size(); i < count; ++i) split(*beliefs[i], groups);
  for (const Group& group : groups) join(group);
  for (const auto& belief : beliefs) {
    for (const Uav& uav : uavs) {
      if (uav.lost_s ? forgotten(uav) : uav.retired() || uav.stalled_s) tasks.give_up(uav.id);
      if (forgotten(uav) || uav.stalled_s) {
        belief->passed.erase(uav.id);  // nobody will be told what it saw
      } else if (!belief->has(uav.id)) {
        belief->note_absent(uav.id, uav.vehicle->state().position_m);
      }
    }
  }
}

/// Every part of a belief's members that went out of range of the others takes a copy along.
void Fleet::Impl::split(Belief& belief, const std::vector<std::vector<std::size_t>>& groups) {
  std::vector<Belief*> parts;
  const Group all = belief.members;
  for (const Group& group : groups) {
    Group part = part_of(belief, group);
    if (part.empty()) continue;
    if (part.size() == all.size()) return;
    if (parts.empty()) {
      parts.push_back(&belief);
    } else {
      beliefs.push_back(belief.clone(next_belief_id++));
      parts.push_back(beliefs.back().get());
    }
    if (parts.size() > 1) parts.back()->members = std::move(part);
  }
  share_tasks(all);
  Group rest = all;
  for (std::size_t i = 1; i < parts.size(); ++i) {
    std::erase_if(rest, [&](std::size_t uav) { return parts[i]->has(uav); });
  }
  belief.members = std::move(rest);
  for (Belief* part : parts) {
    for (const std::size_t uav : all) {
      if (part->has(uav)) {
        uavs[uav].belief = part;
      } else {
        part->known_by[uav] = part->map.revision();
        part->passed[uav].clear();
      }
    }
  }
}

/// Before UAVs go out of range of each other: who answers for what.
void Fleet::Impl::share_tasks(const std::vector<std::size_t>& group) {
  std::vector<coverage3d::TaskBoard::Worker> workers;
  for (const std::size_t id : group) {
    const Uav& uav = uavs[id];
    if (!uav.retired() && !uav.stalled_s)
      workers.push_back({id, uav.goal ? uav.goal->position_m : uav.vehicle->state().position_m});
  }
  tasks.share(workers);
}

/// UAVs of one group that came into touch share what they know; the largest map takes the others in.
void Fleet::Impl::join(const std::vector<std::size_t>& group) {
  Belief* kept = uavs[group.front()].belief;
  for (const std::size_t uav : group) {
    if (uavs[uav].belief->map.known_voxels() > kept->map.known_voxels()) kept = uavs[uav].belief;
  }
  for (const std::size_t uav : group) {
    Belief* const other = uavs[uav].belief;
    if (other == kept) continue;
    stats.voxels_told += kept->absorb(*other);
    ++stats.map_exchanges;
    for (const std::size_t member : other->members) {
      uavs[member].belief = kept;
      kept->members.push_back(member);
    }
    std::ranges::sort(kept->members);
    std::erase_if(beliefs, [&](const auto& one) { return one.get() == other; });
  }
}

}  // namespace stairwell::explore
