"""Landmarks that another program found in pictures or videos: `reading` makes cameras of them.

The forms are OpenPose's, which Pose2Sim and Sports2D write too (`openpose`), MMPose's and AlphaPose's (`mmpose`), and
FreeMoCap's (`freemocap`). `points` maps their points to landmarks of BlazePose, `people` selects the person to
track, `film` gives the times and sizes of the pictures.
"""
