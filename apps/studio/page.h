// The page's files, which are part of the program (page_files.cmake).
#ifndef CIRCLINE_APPS_STUDIO_PAGE_H_
#define CIRCLINE_APPS_STUDIO_PAGE_H_

#include <string>
#include <vector>

namespace circline::apps {

struct PageFile {
  std::string name, type, content;  // type: as in Content-Type.
};

// For as long as the program runs.
const std::vector<PageFile>& PageFiles();

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_STUDIO_PAGE_H_
