// Photos that come with poses of their own.
#include <utility>

#include "circline/refine/adjustment.h"
#include "circline/refine/given_poses.h"
#include "circline/refine/is_rotation.h"

namespace circline {

Status Adjustment::CheckGivenPoses() {
  const std::vector<std::optional<CameraPose>>& poses = options_.given_poses;
  if (poses.empty()) return Status::Ok();
  if (poses.size() != given_.size())
    return Status::Invalid("given_poses must be one for each photo, or none");
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (!poses[i]) {
      out_.photos[i].status = Status::Refused("no pose is given for it");
      is_valid_[i] = 0;
      continue;
    }
    if (!IsRotation(poses[i]->rotation) || !poses[i]->translation.allFinite()) {
      return Status::Invalid("given_poses[" + std::to_string(i) +
                             "] must be a rotation and a finite translation");
    }
    inputs_[i].given = &*poses[i];
  }
  return Status::Ok();
}

bool Adjustment::PlaceByPoses() {
  std::optional<GivenPlacement> placement = PlaceByGivenPoses(estimates_, options_.given_poses);
  if (!placement) return false;
  out_.rigid = true;
  given_frame_ = placement->world;
  ShareWorld(placement->shared, placement->by_id);
  return true;
}

}  // namespace circline
