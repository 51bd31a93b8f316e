#pragma once
/// \file report/detail/pictures.h
/// Pictures of the page that are no curves: the sample before and after, and the last slice of the flow.
#include <filesystem>
#include <string>
#include <vector>

#include "report/case_data.h"

namespace coral::report::detail {

struct NamedPicture {
    std::string file;     ///< name in pictures/, .png
    std::string title;
    std::string caption;
};

/// Draws what the cases have data for into `folder` (made when needed): of up to four cases, the sample cut open at the start and at the end,
/// eroded fines left out [Figs 9, 18], and the last slice of the flow that suffuse drew [Fig. 16].
/// What cannot be drawn is left out with a note.
std::vector<NamedPicture> draw_pictures(const std::vector<CaseData>& cases, const std::filesystem::path& folder, std::vector<std::string>& notes);

}  // namespace coral::report::detail
