"""The page's server: who may come in, what a browser may say, whose session it is.

browser -> AccessHandler (handshake) -> GuardedConnection (each message) -> viser -> callbacks
PageServer: a connection per window, a session per browser, a page per connection
"""
