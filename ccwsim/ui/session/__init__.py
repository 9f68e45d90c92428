"""The state of a session, and the study that the user's choices describe."""

from ccwsim.ui.session.address import (
    CLASS,
    go_to,
    page_link,
    page_link_of,
    show,
    shown_of,
    take_address,
)
from ccwsim.ui.session.cached import as_task, cached, kept_with, shared_values
from ccwsim.ui.session.file_names import grid_part, image_part, study_part
from ccwsim.ui.session.fragments import error_boundary, follow, follow_tasks
from ccwsim.ui.session.kept import cookies, is_new
from ccwsim.ui.session.progress import compilation_to_come, queue_text
from ccwsim.ui.session.resolve import (
    CHOOSE,
    NO_FILE_YET,
    data_of,
    facies_by_code,
    fitted_grid,
    fitting_grids,
    geometry_of,
    grid_of_image,
    image_of,
    maps_of_probabilities,
    opened,
    read_upload,
    refitted,
    secondary_of,
    study_inputs,
    study_of,
    wells_of,
)
from ccwsim.ui.session.server import settle_server
from ccwsim.ui.session.state import (
    KEY,
    PageRun,
    PastRun,
    RunState,
    State,
    session_state,
    start_afresh,
)
from ccwsim.ui.session.uploads import bound_uploads, file_uploader, upload_of
