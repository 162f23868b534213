// Which photos a user names.
#ifndef CIRCLINE_APPS_COMMON_PHOTO_LIST_H_
#define CIRCLINE_APPS_COMMON_PHOTO_LIST_H_

#include <string>
#include <vector>

#include "circline/estimators/status.h"

namespace circline::apps {

// Paths of the photos in a folder itself, sorted; none where it cannot be read. What is a photo its
// name's ending says.
std::vector<std::string> PhotosInFolder(const std::string& folder);

// Paths of the photos that a comma-separated list of files, folders and wildcards names, sorted
// within each. A plain file name need not exist (reading it will tell); a wildcard that matches
// nothing, or a folder without photos, is an error. What exists under the whole name is one, commas
// and all.
Status ListPhotos(const std::string& patterns, std::vector<std::string>* paths);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMMON_PHOTO_LIST_H_
