#pragma once

#include "units/file/corpus.h"
#include "units/file/sqlite_database.h"

namespace mouthpiece {

/// The tables `trajectory_model` and `phone_shapes` of a corpus file (docs/formats/corpus.md).

/// Fills `corpus.trajectory_model` and `lattice_weights`; leaves them alone when the table is empty. Needs the layout.
void readTrajectoryModel(SqliteDatabase& database, Corpus& corpus);
/// Of the take whose row is at hand.
PhoneShapes readShapes(const CheckedQuery& row, std::size_t phones, Eigen::Index components);
/// Looks at the shapes of all takes; throws InputError for what is damaged or missing.
void readAllShapes(SqliteDatabase& database, const Corpus& corpus);
/// Nothing for a corpus without a model.
void writeTrajectoryModel(SqliteDatabase& database, const Corpus& corpus);

}  // namespace mouthpiece
