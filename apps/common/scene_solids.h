// The keys `faces` and `solids` of a scene file's image.
#ifndef CIRCLINE_APPS_COMMON_SCENE_SOLIDS_H_
#define CIRCLINE_APPS_COMMON_SCENE_SOLIDS_H_

#include "apps/common/solids.h"
#include "apps/common/storage_node.h"
#include "circline/estimators/observations.h"

namespace circline::apps {

// `image`: the image's node; `observations`: its circles, which solids may name.
Solids ReadSolids(const StorageNode& image, const Observations& observations);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMMON_SCENE_SOLIDS_H_
