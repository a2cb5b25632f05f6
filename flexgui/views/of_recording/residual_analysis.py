"""What the residual shows: correlations, and the frequency response that was measured."""

from flexgui.core.residual_analysis import residual_analysis
from flexgui.views.layout import Figure
from flexgui.views.of_recording.view import RecordingView, Seen
from flexgui.views.residual_analysis import correlations, responses


class ResidualCorrelations(RecordingView):
    """The residual's correlations with itself and with the inputs."""

    kind = "residual_correlation"
    title = "residual: correlations"
    about = (
        "Each residual's correlations with itself and with the inputs, over their 99 % bands. Of a "
        "complete model one value in a hundred leaves its band by chance. Many outside, with an "
        "input, mean that the model lacks something."
    )
    nothing = "There are too few samples for a correlation."
    in_report = True
    place = 4

    def draw(self, seen: Seen) -> Figure | None:
        return correlations(residual_analysis([seen.current]), seen.current.recording)


class MeasuredResponses(RecordingView):
    """Measured beside modelled frequency response."""

    kind = "measured_response"
    title = "residual: frequency response"
    about = "Frequency response from the inputs, measured (dots) and of the model (lines)."
    nothing = "No output follows the inputs clearly enough, or samples are missing."
    in_report = True
    place = 5

    def draw(self, seen: Seen) -> Figure | None:
        return responses(residual_analysis([seen.current]), seen.current.recording)
