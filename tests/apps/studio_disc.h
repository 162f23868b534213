// A studio, and a photo for it.
#ifndef CIRCLINE_TESTS_APPS_STUDIO_DISC_H_
#define CIRCLINE_TESTS_APPS_STUDIO_DISC_H_

#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "apps/compare/options.h"
#include "apps/studio/studio.h"

namespace circline::apps {

// A bright disc, tilted, on a dark ground.
inline cv::Mat DiscPhoto(int width, int height) {
  cv::Mat photo(height, width, CV_8UC1, cv::Scalar(40));
  cv::ellipse(photo, {width / 2, height / 2}, {width / 5, height / 7}, 20.0, 0.0, 360.0,
              cv::Scalar(220), cv::FILLED, cv::LINE_AA);
  cv::GaussianBlur(photo, photo, {5, 5}, 1.0);
  return photo;
}

inline CompareOptions StudioOptions() {
  CompareOptions options;
  options.solvers = {"joint"};
  options.overlays = false;
  options.losses.resize(1);
  return options;
}

// Of the photos in a folder; `camera` may be null.
inline std::unique_ptr<Studio> OpenStudio(const std::string& folder,
                                          const Camera* camera = nullptr) {
  PhotoFolder photos;
  photos.Open(folder);
  auto studio = std::make_unique<Studio>(StudioOptions(), photos, camera);
  studio->ReadFiles();
  return studio;
}

// The first ellipse of a detection as a scene file's circle.
inline Json SceneOfDisc(const Json& found) {
  const std::string id = found["ellipses"][0]["id"];
  const Json circle = {
      {"id", id}, {"contour", found["contours"][id]}, {"radius", 2.0}, {"plane", "p"}};
  return {{"circles", Json::array({circle})}};
}

}  // namespace circline::apps

#endif  // CIRCLINE_TESTS_APPS_STUDIO_DISC_H_
