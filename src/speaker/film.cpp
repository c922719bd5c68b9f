// The face of a performance as a film.
#include "exports/film/film_file.h"

#include <Eigen/Geometry>
#include <cmath>

#include "exports/film/face_painter.h"
#include "speaker/speaker_data.h"

namespace mouthpiece {

void Performance::Data::film(const std::filesystem::path& path) const {
  constexpr double kMostPictures = 30;  // a second: as films have them, and in time on two cores
  const SharedFace::Data& own = needFace();
  const FaceMotion& moving = faceMotion();
  const double rate = animation.motion.frame_rate_hz;
  const auto step = static_cast<std::size_t>(std::max(1.0, std::ceil(rate / kMostPictures - 1e-9)));
  Film film{.frame_rate_hz = rate / static_cast<double>(step),
            .frame_count = (animation.motion.frameCount() + step - 1) / step,
            .paint = nullptr,
            .sound = animation.audio};
  Eigen::AlignedBox3f focus;
  const auto markers = moving.markers().row(0);
  for (Eigen::Index i = 0; i + 2 < markers.cols(); i += 3)
    focus.extend(markers.segment<3>(i).transpose().cast<float>());
  const FacePainter painter(own.rig().mesh(), focus, film.width, film.height);
  const std::vector<Eigen::Quaternionf> turns = headTurns();
  const Eigen::RowVector3f pivot = neckTop().cast<float>();
  film.paint = [&](std::size_t frame, Picture& picture) {
    VertexPositions vertices = verticesAt(FrameIndex(step * frame));
    if (!turns.empty()) {
      const Eigen::Matrix3f turn = turns[step * frame].toRotationMatrix();
      vertices = ((vertices.rowwise() - pivot) * turn.transpose()).rowwise() + pivot;
    }
    painter.paint(vertices, picture);
  };
  writeFilm(path, film, [&](std::size_t done) {
    if (tell_film) tell_film(done, film.frame_count);
  });
}

}  // namespace mouthpiece
