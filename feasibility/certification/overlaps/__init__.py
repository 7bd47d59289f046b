"""Do bodies overlap in every pose of the tool over a cell, or all over boxes of joint values?"""
