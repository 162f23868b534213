// The one folder that the studio works in: nothing outside it is read or written.
#ifndef CIRCLINE_APPS_STUDIO_PHOTO_FOLDER_H_
#define CIRCLINE_APPS_STUDIO_PHOTO_FOLDER_H_

#include <string>
#include <vector>

#include "circline/estimators/status.h"

namespace circline::apps {

class PhotoFolder {
 public:
  // Not ok: there is no such folder, or it has no photo.
  Status Open(const std::string& path);

  const std::string& path() const { return path_; }
  std::size_t size() const { return names_.size(); }
  const std::string& name(std::size_t n) const { return names_[n]; }
  // Index of the photo of that name, or size().
  std::size_t Find(const std::string& name) const;

  // Where photo n is. Not ok: it is a link that leads out of the folder.
  Status PhotoPath(std::size_t n, std::string* path) const;
  // Where a file or, below it, a folder of that name may be made or replaced. Not ok: what has that
  // name is a link, which might lead out.
  Status OwnPath(const std::string& name, std::string* path) const;

 private:
  std::string path_;                // Without links in it.
  std::vector<std::string> names_;  // Of the photos, sorted; in the folder itself.
};

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_STUDIO_PHOTO_FOLDER_H_
