// SPDX-License-Identifier: BSD-3-Clause
// Sequences made of other sequences: what formats with one file per frame share.
#pragma once

#include "src/format.h"

namespace isoreel::io {

/// Ok when both grids have the same nodes and lie in the same place (to 1/1000 of a cell at every corner,
/// since text headers round); otherwise an error that names both files and what they say.
Status checkSameGrid(const Grid& first, const std::string& firstName, const Grid& second,
                     const std::string& secondName);

/// Sets the nodes of `axis` < 3. Error: kLimit, a number that no grid has.
Status setNodes(Grid& grid, std::size_t axis, std::int64_t nodes);

/// Sets spacing and direction of `axis` < 3 from the world vector between two neighbouring nodes. One without
/// a length leaves a spacing of 0, which checkGrid refuses.
void setAxis(Grid& grid, std::size_t axis, const Vec3d& step);

/// `parts` one after the other. Errors: parts of different grids.
SequenceResult concatenate(std::vector<std::unique_ptr<VolumeSequence>> parts);

/// Opens each file by itself with `openOne` and concatenates.
SequenceResult openEach(const std::vector<std::string>& files,
                        SequenceResult (*openOne)(const std::string& file));

}  // namespace isoreel::io
